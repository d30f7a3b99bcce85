// SPDX-License-Identifier: Apache-2.0
// Cities that the trainers have drawn too: made from a trained model, as `gsc sample replicate` makes them, which gives
// the same bytes everywhere. The pictures lie in the folder `cities` beside the models; its README says how they came
// about.
#pragma once

#include "player/frames/shots.h"
#include "player/options/play_options.h"
#include "runtime/cpu/renderer_cpu.h"
#include "runtime/metrics/metrics.h"
#include <gsc/scene.h>
#include "tests/player/baked_model.h"

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace gsc::test {

// A frame of the city's own path that the trainers have drawn.
struct CityFrame {
    size_t index;
    std::array<uint64_t, 2> anchors_visible; // to the trainers: left eye, right eye
};

struct GoldenCity {
    const char* name;  // folder of the pictures
    const char* model; // model that is repeated
    uint64_t anchors;
    const char* ply_sha256;
    double ipd; // world units between the eyes of the pictures; the city's own paths have had another metre since
    std::vector<CityFrame> frames;
};

struct CityView {
    Image eyes[2];
    FrameResult result;
};

// A city, converted and opened. It lies in the temporary folder and goes away with the object.
class City {
public:
    // Checks the hash of the PLY. The PLY is gone afterwards: a large one has 6 GB, and so has the .gsc.
    City(const GoldenCity& golden, const std::string& model);

    [[nodiscard]] const GoldenCity& golden() const { return m_golden; }
    [[nodiscard]] const Scene& scene() const { return *m_scene; }

    // Draws as gsc-play with --eyes 2 --size 1024x1024 --fov 90. Precondition: `backend` has loaded scene().
    [[nodiscard]] CityView render(Renderer& backend, size_t frame, Tier tier) const;

private:
    const GoldenCity& m_golden;
    std::optional<BakedModel> m_baked;
    std::unique_ptr<Scene> m_scene;
    PlayOptions m_options;
    std::vector<Shot> m_shots;
};

// The city whose pictures lie in the folder `name`. Null, after a note, where model or pictures are missing.
std::unique_ptr<City> openCity(const std::string& name);

// Bounds that a picture must keep: PSNR at least, error of the worst pixel at most.
struct PictureBar {
    double psnr;        // dB
    double worst_pixel; // largest error of a channel, 0..1
};

// Holds both eyes of a frame to the trainers' pictures, and the numbers of visible anchors to theirs; prints a line each.
void checkFrame(const City& city, const CityFrame& frame, const CityView& view, const char* renderer,
                const PictureBar& bar);

// Holds both eyes to other pictures of ours; prints a line each.
void checkViews(const City& city, size_t frame, const CityView& view, const CityView& expected, const char* renderers,
                double least_psnr, PooledDifference& pooled);

} // namespace gsc::test
