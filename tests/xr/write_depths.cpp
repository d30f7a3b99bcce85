// SPDX-License-Identifier: Apache-2.0
// write_depths FILE.gsc CAMERAS OUT: depths that the renderer on the host finds for each camera of a file, fp32, picture
// after picture: what those submitted to a headset are held against.
#include "player/frames/shots.h"
#include "player/options/play_options.h"
#include <gsc/renderer.h>

#include <cstdio>
#include <exception>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <vector>

namespace {

void write(const gsc::PlayOptions& options, const char* path)
{
    gsc::Reporter log{gsc::ReporterOptions{}};
    const std::shared_ptr<const gsc::Scene> scene = gsc::Scene::open(options.model.file, options.model.verify);
    const auto renderer = gsc::makeRenderer(gsc::DeviceId{"cpu"}, {});
    renderer->load(scene);
    gsc::FrameOptions frame = gsc::frameOptions(*scene, options.frame);
    std::ofstream out(path, std::ios::binary);
    for (const gsc::Shot& shot : gsc::chooseShots(*scene, options.model.file, options.cameras, options.view, log)) {
        gsc::EyeParams eye;
        gsc::shotEyes(shot, 1, &eye);
        frame.appearance = gsc::shotAppearance(*scene, shot);
        const size_t count = size_t(eye.width) * eye.height;
        std::vector<float> pixels(3 * count), depths(count);
        gsc::FrameTarget target = gsc::hostTarget(pixels.data());
        target.depth = depths.data();
        gsc::render(*renderer, {{&eye, 1}, {&target, 1}, frame});
        out.write(reinterpret_cast<const char*>(depths.data()), std::streamsize(count * sizeof(float)));
    }
    if (!out.good())
        throw std::runtime_error("the depths cannot be written");
}

} // namespace

int main(int argc, char** argv)
{
    if (argc != 4) {
        std::fprintf(stderr, "usage: write_depths FILE.gsc CAMERAS OUT\n");
        return 1;
    }
    gsc::PlayOptions options;
    options.model.file = argv[1];
    options.cameras.file = argv[2];
    try {
        write(options, argv[3]);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
    return 0;
}
