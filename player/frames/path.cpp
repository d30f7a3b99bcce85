// SPDX-License-Identifier: Apache-2.0
#include "player/frames/path.h"

#include <filesystem>

namespace gsc {

Path openPath(const Scene& scene, const std::string& model, const CameraChoice& choice, const ViewChoice& view,
              const std::string& listed, Reporter& log)
{
    Path path;
    ShotFacts facts;
    path.shots = chooseShots(scene, model, choice, view, log, &facts);
    path.name = facts.title;
    path.no_path = facts.no_path;
    path.cameras = listed;
    path.eye_count = uint32_t(view.eyes);
    if (path.name.empty())
        path.name = std::filesystem::path(listed).stem().string();
    return path;
}

} // namespace gsc
