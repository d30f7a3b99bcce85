// SPDX-License-Identifier: Apache-2.0
// Scores of pictures against the exact ones: of each by itself, and of changes from one to the next. Computed on the
// host, or on the device where the pictures are.
#pragma once

#include "kernels/metrics/square_sums.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

// A picture in memory: height x width x 3 floats, interleaved RGB without gaps.
struct PictureRef {
    const float* pixels = nullptr;
    uint32_t width = 0, height = 0;
    bool on_device = false; // true: in memory of the scorer's device; false: of this process
};

// Sums over the pixels inside, or outside, of the sharp centre of foveation.
struct FoveaSums {
    uint64_t pixels = 0;
    double squares = 0;         // sum of the squared errors of all channels; infinite if one is NaN
    std::optional<double> flip; // sum of FLIP over the pixels; none if it was not asked for
};

struct PictureScores {
    double mse = 0;          // mean squared error over pixels and channels
    double psnr = 0;         // PSNR: 10 log10(1 / mse) in dB, +inf if the pictures are equal
    double max_error = 0;    // largest |image - exact| of any channel
    uint64_t over_1_255 = 0; // number of pixels with a channel that differs by more than 1/255
    // Root mean square of the change since this eye's last picture: `change` that of image - exact, `motion` that of
    // the image. None for the first picture, or if the size has changed; NaN if a pixel is NaN.
    std::optional<double> change, motion;
    // Largest pop of a square of 16 x 16 pixels: how far the change of the square in this eye's last picture but one
    // exceeds its changes before and after. None until four pictures of one size have come.
    std::optional<double> pop, error_pop; // pop of the picture; pop of the error image (image - exact)
    std::optional<double> ssim, flip;     // scores of these names, none if they were not asked for
    FoveaSums fovea[2];                   // sums inside and outside of the sharp centre at `gaze`
};

struct ScoreRequest {
    bool ssim = false, flip = false;
    const EyeGaze* gaze = nullptr; // where the eye looks; null: no foveation, everything counts as outside
};

class PictureScorer {
public:
    virtual ~PictureScorer() = default;

    // Scores a picture of an eye. Pictures of one eye must come in order; `image` and `exact` have one size. Throws
    // Error (OutOfMemory, Device).
    virtual PictureScores score(uint32_t eye, const PictureRef& image, const PictureRef& exact,
                                const ScoreRequest& request) = 0;

    // The next picture of each eye is not compared with earlier ones.
    virtual void forget() = 0;
};

// Makes a scorer that takes pictures in memory of this process.
std::unique_ptr<PictureScorer> makeHostScorer();

// Changes of one eye's last pictures, for each square of 16 x 16 pixels.
class SquareHistory {
public:
    void forget() { m_known = 0; }

    // Adds up the squares of a picture, which are row by row, stores them, and sets the scores that depend on earlier
    // pictures.
    void add(std::span<const SquareSums> squares, uint32_t width, uint32_t height, PictureScores& scores);

private:
    // Changes of each square over the last pictures, oldest first: root mean squares over pixels and channels.
    struct Changes {
        std::vector<double> before, now, after;

        void add(std::span<const SquareSums> squares, double SquareSums::*sum, uint32_t width, uint32_t height);
        // Largest excess, over all squares, of the middle change over the ones before and after it.
        [[nodiscard]] double pop() const;
    };

    uint32_t m_width = 0, m_height = 0;
    Changes m_picture, m_error;
    uint32_t m_known = 0; // number of pictures of this size in a row
};

// Number of squares of 16 pixels along a side of `pixels` pixels.
constexpr uint32_t squaresAlong(uint32_t pixels)
{
    return (pixels + kScoreSquare - 1) / kScoreSquare;
}

} // namespace gsc
