// SPDX-License-Identifier: Apache-2.0
// Scores of pictures that lie on a device: the sums of metrics.h and picture_scorer.h, per square of 16 x 16 pixels. All
// launches are asynchronous; planes are height x width floats. Values are those of the CPU but for the last bits of powers
// and roots.
#pragma once

#include "kernels/metrics/flip_rules.h"
#include "kernels/metrics/square_sums.h"

struct CUstream_st;

namespace gsc {

// Two pictures of height x width x 3 floats.
struct PicturePair {
    const float *image, *exact;
    uint32_t width, height;
};

// Direction of the fovea; without one all pixels are outside.
struct ScoreGaze {
    EyeGaze gaze;
    bool present;
};

struct SquareSumsCudaArgs {
    PicturePair pair;
    ScoreGaze gaze;
    float *last_error, *last_image; // height x width x 3, of the picture before; first values are ignored
    SquareSums* squares;            // row by row
};
void squareSumsCuda(const SquareSumsCudaArgs& args, CUstream_st* stream);

constexpr uint32_t kMostFilterRadius = 15;

// Weights of an odd number of neighbours, from the one `radius` before a value to the one `radius` behind it.
struct FilterWeights {
    double weight[2 * kMostFilterRadius + 1];
    int32_t radius;
};

// SSIM of one channel: filters along rows into five planes, then along columns, and adds up the squares.
struct SsimCudaArgs {
    PicturePair pair;
    uint32_t channel;
    FilterWeights window;
    float* planes[5]; // scratch: a, b, a a, b b, a b
    double* squares;  // sums over the pixels
};
void ssimCuda(const SsimCudaArgs& args, CUstream_st* stream);

// The opponent planes of a picture.
struct OpponentCudaArgs {
    const float* image;
    uint32_t width, height;
    float* planes[3];
};
void opponentCuda(const OpponentCudaArgs& args, CUstream_st* stream);

// Filters a plane along rows with up to three filters at once. The border repeats.
struct RowFilterCudaArgs {
    const float* plane;
    uint32_t width, height;
    uint32_t count; // number of filters
    bool lightness; // filters (value + 16) / 116
    FilterWeights filters[3];
    float* out[3];
};
void filterRowsCuda(const RowFilterCudaArgs& args, CUstream_st* stream);

// Filters one or two planes along columns and adds up a share of each.
struct ColumnFilterCudaArgs {
    uint32_t width, height;
    uint32_t count; // number of planes
    const float* planes[2];
    FilterWeights filters[2];
    float shares[2];
    float* out;
};
void filterColumnsCuda(const ColumnFilterCudaArgs& args, CUstream_st* stream);

// Strength of edges and points from a plane that filterRowsCuda() has filtered with each of the three.
struct FeatureCudaArgs {
    uint32_t width, height;
    const float *blurred, *first, *second; // along rows
    FilterWeights blur, edge, point;       // along columns
    FlipFeatures* out;                     // height x width
};
void flipFeaturesCuda(const FeatureCudaArgs& args, CUstream_st* stream);

struct FlipCudaArgs {
    uint32_t width, height;
    const float *image[3], *exact[3]; // filtered opponent planes
    const FlipFeatures *image_features, *exact_features;
    double largest; // largestFlipColor()
    ScoreGaze gaze;
    SquareFlip* squares;
};
void flipSquaresCuda(const FlipCudaArgs& args, CUstream_st* stream);

} // namespace gsc
