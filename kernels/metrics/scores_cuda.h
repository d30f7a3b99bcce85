// SPDX-License-Identifier: Apache-2.0
// Scores of pictures that lie on a device: the sums of metrics.h and picture_scorer.h for each square of 16 x 16
// pixels. All launches are asynchronous. A plane is height x width floats. Values equal those of the CPU except for the
// last bits of powers and roots.
#pragma once

#include "kernels/metrics/flip_rules.h"
#include "kernels/metrics/square_sums.h"

struct CUstream_st;

namespace gsc {

// Two pictures, each height x width x 3 floats.
struct PicturePair {
    const float *image, *exact;
    uint32_t width, height;
};

// Direction of the gaze of an eye; without one, all pixels count as outside the fovea.
struct ScoreGaze {
    EyeGaze gaze;
    bool present;
};

struct SquareSumsCudaArgs {
    PicturePair pair;
    ScoreGaze gaze;
    // height x width x 3 values of the picture before; for the first picture of an eye their content is ignored
    float *last_error, *last_image;
    SquareSums* squares; // one element for each square, row by row
};
void squareSumsCuda(const SquareSumsCudaArgs& args, CUstream_st* stream);

constexpr uint32_t kMostFilterRadius = 15;

// Weights of a filter over an odd number of neighbours, from `radius` values before to `radius` values behind.
struct FilterWeights {
    double weight[2 * kMostFilterRadius + 1];
    int32_t radius;
};

// SSIM of one channel: filters along rows into five planes, then along columns, and adds up the result in squares.
struct SsimCudaArgs {
    PicturePair pair;
    uint32_t channel;
    FilterWeights window;
    float* planes[5]; // scratch for filtered planes of a, b, a a, b b, a b
    double* squares;  // for each square the sum over its pixels
};
void ssimCuda(const SsimCudaArgs& args, CUstream_st* stream);

// Converts a picture to the three planes of an opponent colour space.
struct OpponentCudaArgs {
    const float* image;
    uint32_t width, height;
    float* planes[3];
};
void opponentCuda(const OpponentCudaArgs& args, CUstream_st* stream);

// Filters a plane along rows with up to three filters at once. Beyond the border its value is repeated.
struct RowFilterCudaArgs {
    const float* plane;
    uint32_t width, height;
    uint32_t count; // number of filters, 1 to 3
    bool lightness; // true: filters (value + 16) / 116 in place of the value
    FilterWeights filters[3];
    float* out[3];
};
void filterRowsCuda(const RowFilterCudaArgs& args, CUstream_st* stream);

// Filters one or two planes along columns and adds a share of each.
struct ColumnFilterCudaArgs {
    uint32_t width, height;
    uint32_t count; // number of planes, 1 or 2
    const float* planes[2];
    FilterWeights filters[2];
    float shares[2];
    float* out;
};
void filterColumnsCuda(const ColumnFilterCudaArgs& args, CUstream_st* stream);

// Computes the strength of edges and points from a plane that filterRowsCuda() has filtered with the three filters.
struct FeatureCudaArgs {
    uint32_t width, height;
    const float *blurred, *first, *second; // plane filtered along rows with each filter
    FilterWeights blur, edge, point;       // weights of the filters along columns
    FlipFeatures* out;                     // height x width elements
};
void flipFeaturesCuda(const FeatureCudaArgs& args, CUstream_st* stream);

struct FlipCudaArgs {
    uint32_t width, height;
    const float *image[3], *exact[3]; // opponent planes after filtering
    const FlipFeatures *image_features, *exact_features;
    double largest; // largest difference of colours, from largestFlipColor()
    ScoreGaze gaze;
    SquareFlip* squares;
};
void flipSquaresCuda(const FlipCudaArgs& args, CUstream_st* stream);

} // namespace gsc
