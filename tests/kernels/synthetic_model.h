// SPDX-License-Identifier: Apache-2.0
// Models in memory, laid out as a .gsc file would be, for tests and benchmarks of the stages.
#pragma once

#include "convert/input/checkpoint.h"
#include <gsc/frame_types.h>
#include "kernels/math/eye.h"

#include <cstdint>
#include <memory>
#include <vector>

namespace gsc::test {

struct SyntheticAnchors {
    std::vector<float> position;    // n x 3; moved onto the grid if the model has one
    std::vector<int32_t> level;     // n
    std::vector<float> extra_level; // n
    std::vector<float> offset;      // n x K x 3
    std::vector<float> feature;     // n x F
    std::vector<float> scale;       // n x 6, natural logs
    std::vector<float> rotation;    // n x 4, empty = the constant of the parameters

    [[nodiscard]] size_t count() const { return level.size(); }
};

// Sizes and properties of a random model.
struct SyntheticOptions {
    uint32_t anchors = 500;
    uint32_t feat_dim = 32;
    uint32_t n_offsets = 10;
    uint32_t appearance_dim = 0;
    uint32_t appearance_rows = 0;
    uint32_t levels = 1;
    uint32_t flags = 0;  // ModelFlags; the bank flags add the network
    uint32_t inputs = 0; // MlpInputs of the three heads beside the feature
    LevelRule level_rule = LevelRule::None;
    RasterRules raster_rules = RasterRules::DiffGaussian;
    PositionEncoding encoding = PositionEncoding::Grid;
    uint32_t cell_log2 = 0;
    float log_scale = -3.2f; // mean of all six logs
    float extent = 4;        // anchors fill [-extent, extent]^3
    uint32_t seed = 1;
};

// A model with four levels, with rule None one without; seed 0 = a seed for each rule.
inline SyntheticOptions octree(LevelRule rule, uint32_t anchors = 1500, uint32_t seed = 0)
{
    SyntheticOptions options;
    options.anchors = anchors;
    options.seed = seed != 0 ? seed : 40 + uint32_t(rule);
    if (rule != LevelRule::None) {
        options.levels = 4;
        options.level_rule = rule;
        options.flags = kModelHasLevels | kModelLodHalfCell;
    }
    return options;
}

// Uniform in [0, 1) from the top bits of an mt19937 draw: the same on every standard library.
class Random {
public:
    explicit Random(uint32_t seed);
    ~Random();
    float uniform();
    float uniform(float low, float high) { return low + (high - low) * uniform(); }
    float normal(); // sum of twelve uniforms less six

private:
    struct State;
    std::unique_ptr<State> m_state;
};

SyntheticAnchors randomAnchors(const SyntheticOptions& options);
// Masks slots of every kind of place: some of an anchor, and all of some. The model's flags need kModelMaskedSlots.
void maskSlots(SyntheticAnchors& anchors, uint32_t n_offsets);
[[nodiscard]] bool isSlotMasked(uint32_t anchor, uint32_t k); // by maskSlots()
// Moves features and offsets to the steps of a compact model. Before slots are masked.
void makeCompact(SyntheticAnchors& anchors, const SyntheticOptions& options);
std::vector<Mlp> randomMlps(const SyntheticOptions& options);
ModelParams syntheticParams(const SyntheticOptions& options);

class SyntheticModel {
public:
    explicit SyntheticModel(const SyntheticOptions& options);
    // `params` as syntheticParams() fills them; counts and bounds are computed here.
    SyntheticModel(const ModelParams& params, const SyntheticAnchors& anchors, const std::vector<Mlp>& mlps,
                   std::vector<float> embedding, uint32_t cell_log2);
    SyntheticModel(const SyntheticModel&) = delete;
    SyntheticModel& operator=(const SyntheticModel&) = delete;
    ~SyntheticModel();

    [[nodiscard]] const ModelView& view() const;
    [[nodiscard]] ModelParams& params(); // to change a rule; layout must stay

private:
    struct Storage;
    std::unique_ptr<Storage> m_storage;
};

// An eye at `position` that looks at `target`, y down the image.
EyeParams lookAt(const float* position, const float* target, float fov_y, uint32_t width, uint32_t height);
// Constants of a rasteriser with the near plane of its trainer.
RasterConstants rulesOf(RasterRules rules);
EyeParams eyeAt(float x, float z, uint32_t width, uint32_t height);    // looks at the middle
EyeParams eyeAhead(float x, float z, uint32_t width, uint32_t height); // looks along z, as do all of these
// An eye in [-reach, reach]^3 that looks at a point near the middle; its opening and its image are random too.
EyeParams randomEye(Random& random, float reach);
EyeParams64 widen(const EyeParams& eye);
// The eye with its image's middle moved right and down of the axis: off-centre, as in a headset.
EyeParams offCentre(EyeParams eye, float tan_mid_x, float tan_mid_y);

} // namespace gsc::test
