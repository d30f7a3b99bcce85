// SPDX-License-Identifier: Apache-2.0
// Our decode stage on a real model, driven from outside so that it can be timed in turns with something else.
//   bench_decode_model FILE.gsc CAMERA THREADS DUMP
// CAMERA is an index into the file's cameras. DUMP receives, little-endian: uint32 n, F, K, then float[n][F] features,
// float[n][3] directions and float[n][K] opacities (0 where below 1/255) of the visible anchors. Then every line "run"
// on stdin decodes the frame once and answers with its milliseconds; end of input ends the program.
#include <gsc/error.h>
#include "kernels/threads/parallel.h"
#include "kernels/threads/stopwatch.h"
#include "kernels/decode/decode.h"
#include <gsc/camera.h>
#include <gsc/scene.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <memory>
#include <vector>

using namespace gsc;

namespace {

Camera toCamera(const SourceCamera& from)
{
    Camera camera;
    camera.name = from.name;
    std::copy_n(from.rotation, 9, camera.rotation);
    for (int i = 0; i < 3; ++i)
        camera.translation[i] = -(from.rotation[i] * from.position[0] + from.rotation[3 + i] * from.position[1] +
                                  from.rotation[6 + i] * from.position[2]);
    camera.width = from.width;
    camera.height = from.height;
    camera.fov_x = 2 * std::atan(from.width / (2 * from.fx));
    camera.fov_y = 2 * std::atan(from.height / (2 * from.fy));
    return camera;
}

class Decoder {
public:
    Decoder(const ModelView& model, const EyeParams& eye, int32_t appearance, int threads)
        : m_model(model), m_eye(eye), m_appearance(appearance), m_workers(threads), m_scratch(size_t(m_workers.count()))
    {
        SelectScratch scratch;
        SelectCounts counts{};
        m_count = selectCpu({&m_model, &m_eye, 1, rasterConstants(*model.params, 0), 0}, m_workers, scratch, m_visible,
                            counts);
        for (DecodeScratch& s : m_scratch)
            reserveDecode(model, s);
    }

    double run()
    {
        Stopwatch watch;
        forEachBlock([](size_t, const GaussianBlock&) {});
        return watch.lap();
    }

    void dump(const char* path)
    {
        const uint32_t F = m_model.params->feat_dim, K = m_model.params->n_offsets;
        std::vector<float> features, directions, opacities(m_count * K);
        for (size_t i = 0; i < m_count; ++i) {
            const VisibleAnchor& anchor = m_visible[i];
            const float* feature = m_model.arrays[anchor.chunk].feature + size_t(F) * anchor.local;
            features.insert(features.end(), feature, feature + F);
            const ViewInput<float> view = viewInput<float>(
                m_model, m_eye.center, anchorPosition(m_model, anchor.chunk, anchor.local), anchor.chunk, -1);
            directions.insert(directions.end(), view.direction, view.direction + 3);
        }
        forEachBlock([&](size_t first, const GaussianBlock& block) {
            for (uint32_t g = 0; g < block.count; ++g)
                opacities[first * K + block.origin[g]] = block.opacity[g];
        });
        std::ofstream file(path, std::ios::binary);
        const uint32_t header[3] = {uint32_t(m_count), F, K};
        const auto write = [&file](const void* data, size_t bytes) {
            file.write(static_cast<const char*>(data), std::streamsize(bytes));
        };
        write(header, sizeof(header));
        write(features.data(), features.size() * sizeof(float));
        write(directions.data(), directions.size() * sizeof(float));
        write(opacities.data(), opacities.size() * sizeof(float));
        if (!file.flush())
            throw Error(ErrorCode::Io, path, "cannot be written", "room for the dump", "free some space");
    }

private:
    template <typename Body>
    void forEachBlock(Body&& body)
    {
        const DecodeArgs args = prepareDecode(m_model, &m_eye, 1, m_visible.data(), m_count, m_appearance, m_bias);
        m_workers.run((m_count + kDecodeBlock - 1) / kDecodeBlock, 1, [&](size_t begin, size_t end, int worker) {
            DecodeScratch& scratch = m_scratch[size_t(worker)];
            for (size_t b = begin; b < end; ++b) {
                const size_t first = b * kDecodeBlock;
                decodeBlockCpu(args, first, uint32_t(std::min<size_t>(kDecodeBlock, m_count - first)), scratch);
                body(first, scratch.blocks[0]);
            }
        });
    }

    ModelView m_model;
    EyeParams m_eye;
    int32_t m_appearance;
    Workers m_workers;
    std::vector<DecodeScratch> m_scratch;
    Buffer<VisibleAnchor> m_visible;
    Buffer<float> m_bias;
    size_t m_count = 0;
};

int benchmark(int argc, char** argv)
{
    if (argc != 5)
        throw Error(ErrorCode::Usage, "bench_decode_model", "other words", "FILE.gsc CAMERA THREADS DUMP",
                    "pass these");
    const std::unique_ptr<Scene> scene = Scene::open(argv[1]);
    const size_t index = size_t(std::atoi(argv[2]));
    if (index >= scene->cameras().size())
        throw Error(ErrorCode::Usage, argv[1], formatString("camera %zu", index),
                    formatString("fewer than %zu", scene->cameras().size()), "choose another");
    const ModelParams& params = *scene->view().params;
    Decoder decoder(scene->view(), eyeParams(toCamera(scene->cameras()[index]), scene->view().origin),
                    params.appearance_dim > 0 ? 0 : -1, std::atoi(argv[3]));
    decoder.dump(argv[4]);
    std::cout << "ready" << std::endl;
    for (std::string line; std::getline(std::cin, line) && line == "run";)
        std::cout << decoder.run() << std::endl;
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    try {
        return benchmark(argc, argv);
    } catch (const Error& error) {
        std::fprintf(stderr, "%s\n", error.what());
        return int(error.code());
    }
}
