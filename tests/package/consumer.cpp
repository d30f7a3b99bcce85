// SPDX-License-Identifier: Apache-2.0
// Opens a model with the installed library and renders a frame of it.
#include <gsc/error.h>
#include <gsc/camera.h>
#include <gsc/frame_stats.h>
#include <gsc/renderer.h>
#include <gsc/scene.h>

#include <cmath>
#include <cstdio>
#include <vector>

int main(int argc, char** argv)
{
    if (argc != 2)
        return 1;
    try {
        const std::shared_ptr<const gsc::Scene> scene = gsc::Scene::open(argv[1]);
        const auto renderer = gsc::makeRenderer({}, {.threads = 1});
        renderer->load(scene);
        gsc::Camera camera;
        camera.translation[2] = 5;
        gsc::finishCamera(camera, 64, 48, 1.0);
        const gsc::EyeParams eye = gsc::eyeParams(camera, scene->view().origin);
        std::vector<float> image(size_t(64) * 48 * 3, NAN);
        float* pixels = image.data();
        gsc::FrameStats stats;
        stats.result = gsc::render(*renderer, {&eye, 1}, {}, &pixels);
        for (const float value : image)
            if (!std::isfinite(value))
                return 2;
        stats.backend = renderer->id().backend;
        std::printf("%s\n", gsc::frameStatsJson(stats).c_str());
        return 0;
    } catch (const gsc::Error& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return int(e.code());
    }
}
