// SPDX-License-Identifier: Apache-2.0
// Most that a stop by tiles could save (occlusion: design section 4). A tile of 16 x 16 pixels is finished where the
// rasteriser's own stop has ended all of its pixels. Pairs of a tile and a Gaussian behind that place need no sort, and an
// anchor all of whose pairs are behind it, in both eyes, need not have been decoded; nor a group of 128 such anchors. A
// frame can use less of it: it learns where tiles finish while it draws. Runs on the CPU, in fp32.
//
//   bench_occlusion FILE.gsc [cameras = stored] [frames = 8] [size = 2048] [horizontal angle = 90] [threads = 0]
//
// Two eyes of size x size at cameras evenly spread over those of the file. Shares are of what the frame shows.
#include "player/frames/shots.h"
#include "player/options/play_options.h"
#include "runtime/cli/reporter.h"

#include "kernels/blend/blend.h"
#include "kernels/math/anchor.h"
#include "kernels/threads/parallel.h"
#include "runtime/cpu/frame_cpu.h"

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <string>
#include <vector>

using namespace gsc;

namespace {

struct Totals {
    uint64_t anchors = 0, anchors_needed = 0;
    uint64_t groups = 0, groups_needed = 0;
    uint64_t pairs = 0, pairs_needed = 0;

    void add(const Totals& other)
    {
        anchors += other.anchors;
        anchors_needed += other.anchors_needed;
        groups += other.groups;
        groups_needed += other.groups_needed;
        pairs += other.pairs;
        pairs_needed += other.pairs_needed;
    }

    void print(const char* name) const
    {
        const auto saved = [](uint64_t needed, uint64_t all) {
            return all == 0 ? 0.0 : 100 * double(all - needed) / double(all);
        };
        std::printf(
            "%-20s could be spared: anchors %5.1f %% of %9llu, groups %5.1f %% of %7llu, pairs %5.1f %% of %llu\n",
            name, saved(anchors_needed, anchors), static_cast<unsigned long long>(anchors),
            saved(groups_needed, groups), static_cast<unsigned long long>(groups), saved(pairs_needed, pairs),
            static_cast<unsigned long long>(pairs));
        std::fflush(stdout);
    }
};

class OcclusionMeter {
public:
    OcclusionMeter(const ModelView& model, int threads) : m_frame(threads) { m_frame.load(model); }

    Totals measure(const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options)
    {
        FrameResult result;
        m_frame.select(eyes, eye_count, options, result);
        m_frame.decode(eyes, eye_count, options, result);
        Totals totals;
        totals.anchors = m_frame.visible_count;
        m_needed.assign(m_frame.visible_count, 0);
        const RasterConstants rules = rasterConstants(*m_frame.model.params, options.near_z);
        for (uint32_t e = 0; e < eye_count; ++e) {
            m_frame.list(e, eyes[e], m_frame.blocks(), nullptr, result);
            totals.pairs += result.eyes[e].pairs;
            totals.pairs_needed += pairsNeeded(e, eyes[e], rules);
        }
        countNeeded(totals);
        return totals;
    }

private:
    uint64_t pairsNeeded(uint32_t e, const EyeParams& eye, const RasterConstants& rules)
    {
        std::atomic<uint64_t> needed{0};
        m_frame.workers.run(size_t(tileCount(eye.width)) * tileCount(eye.height), 4,
                            [&](size_t begin, size_t end, int) {
                                for (size_t tile = begin; tile < end; ++tile)
                                    needed += walk(tile, e, eye, rules);
                            });
        return needed;
    }

    // How many of a tile's pairs come before all of its pixels are done; marks their anchors.
    uint64_t walk(size_t tile, uint32_t e, const EyeParams& eye, const RasterConstants& rules)
    {
        const uint32_t grid_x = tileCount(eye.width);
        const auto x0 = uint32_t(tile % grid_x) * kTileSize, y0 = uint32_t(tile / grid_x) * kTileSize;
        const uint32_t x1 = std::min(x0 + kTileSize, eye.width), y1 = std::min(y0 + kTileSize, eye.height);
        PixelState<float> pixels[kTileSize * kTileSize];
        for (PixelState<float>& pixel : pixels)
            pixel = {{0, 0, 0}, 1, false};
        uint32_t open = (x1 - x0) * (y1 - y0);
        uint32_t i = m_frame.bin.tile_first[tile];
        for (; i < m_frame.bin.tile_first[tile + 1] && open > 0; ++i) {
            const uint32_t at = m_frame.bin.entries[i];
            const Splat& splat = m_frame.bin.splats[at];
            for (uint32_t y = std::max<uint32_t>(y0, splat.y0); y < std::min<uint32_t>(y1, splat.y1 + 1u); ++y)
                for (uint32_t x = std::max<uint32_t>(x0, splat.x0); x < std::min<uint32_t>(x1, splat.x1 + 1u); ++x) {
                    PixelState<float>& pixel = pixels[(y - y0) * kTileSize + x - x0];
                    if (pixel.done)
                        continue;
                    blendStep(rules, splat.conic, splat.x - float(x), splat.y - float(y), splat.opacity, splat.color,
                              pixel);
                    open -= pixel.done;
                }
            const uint32_t slot = m_frame.sort.keys[0][at].slot;
            const size_t anchor = size_t(slot / m_frame.capacity) * kDecodeBlock +
                                  m_frame.stores[e].origins[slot] / m_frame.model.params->n_offsets;
            std::atomic_ref(m_needed[anchor]).store(1, std::memory_order_relaxed);
        }
        return i - m_frame.bin.tile_first[tile];
    }

    void countNeeded(Totals& totals) const
    {
        uint64_t last = UINT64_MAX;
        bool last_needed = false;
        for (size_t i = 0; i < m_frame.visible_count; ++i) { // in file order, so those of a group follow each other
            const VisibleAnchor& anchor = m_frame.visible[i];
            const uint64_t group = m_frame.model.chunks[anchor.chunk].group_first + anchor.local / kGroupSize;
            if (group != last) {
                totals.groups_needed += last_needed;
                last_needed = false;
                last = group;
                ++totals.groups;
            }
            totals.anchors_needed += m_needed[i];
            last_needed = last_needed || m_needed[i] != 0;
        }
        totals.groups_needed += last_needed;
    }

    CpuFrame m_frame;
    std::vector<uint8_t> m_needed; // per visible anchor
};

} // namespace

int main(int argc, char** argv)
{
    if (argc < 2)
        return 2;
    try {
        PlayOptions options;
        options.model.file = argv[1];
        options.cameras.file = argc > 2 ? argv[2] : "stored";
        const auto frames = size_t(argc > 3 ? std::atoi(argv[3]) : 8);
        options.view.width = options.view.height = uint32_t(argc > 4 ? std::atoi(argv[4]) : 2048);
        options.view.fov_x = (argc > 5 ? std::atof(argv[5]) : 90) * std::numbers::pi / 180;
        options.view.eyes = 2;
        const std::shared_ptr<const Scene> scene = Scene::open(options.model.file);
        Reporter log({.quiet = true});
        const std::vector<Shot> shots = chooseShots(*scene, options.model.file, options.cameras, options.view, log);
        OcclusionMeter meter(scene->view(), argc > 6 ? std::atoi(argv[6]) : 0);
        Totals all;
        for (size_t i = 0; i < std::min(frames, shots.size()); ++i) {
            const Shot& shot = shots[i * shots.size() / std::min(frames, shots.size())];
            EyeParams eyes[kMaxEyes];
            shotEyes(shot, 2, eyes);
            FrameOptions frame = frameOptions(*scene, options.frame);
            frame.appearance = shotAppearance(*scene, shot);
            const Totals totals = meter.measure(eyes, 2, frame);
            totals.print(shot.camera.name.c_str());
            all.add(totals);
        }
        all.print("all");
        return 0;
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
