// SPDX-License-Identifier: Apache-2.0
// Scores of pictures against the exact ones, by themselves and from one to the next, on the host or where they are drawn.
#pragma once

#include "kernels/metrics/square_sums.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace gsc {

// height x width x 3 floats, interleaved RGB without gaps.
struct PictureRef {
    const float* pixels = nullptr;
    uint32_t width = 0, height = 0;
    bool on_device = false; // memory of the scorer's device; else of this process
};

// Sums over the pixels on one side of a fovea's edge.
struct FoveaSums {
    uint64_t pixels = 0;
    double squares = 0;         // sum of squared errors of all channels; infinite where one is no number
    std::optional<double> flip; // sum over the pixels; none where it was not asked for
};

struct PictureScores {
    double mse = 0;          // mean over pixels and channels
    double psnr = 0;         // 10 log10(1 / mse), +inf if equal
    double max_error = 0;    // largest |image - exact| of any channel
    uint64_t over_1_255 = 0; // pixels with a channel off by more than 1/255
    // Root mean squares of the change since this eye's last picture, of image - exact and of the image; none where that had
    // another size or there was none. Not a number where a pixel is not.
    std::optional<double> change, motion;
    // By how much the change of a square of 16 x 16 pixels in this eye's picture before this was above those before and after
    // it, the largest of the picture; none with fewer than four in a row.
    std::optional<double> pop, error_pop; // pop of the picture; pop of image - exact
    std::optional<double> ssim, flip;     // none where not asked for
    FoveaSums fovea[2];                   // inside, outside; of a gaze
};

struct ScoreRequest {
    bool ssim = false, flip = false;
    const EyeGaze* gaze = nullptr; // null = no foveation: all is outside
};

class PictureScorer {
public:
    virtual ~PictureScorer() = default;

    // Pictures of an eye come in order, `image` and `exact` of one size. Throws Error (OutOfMemory, Device).
    virtual PictureScores score(uint32_t eye, const PictureRef& image, const PictureRef& exact,
                                const ScoreRequest& request) = 0;

    // The next picture of every eye follows none.
    virtual void forget() = 0;
};

// Takes pictures in memory of this process.
std::unique_ptr<PictureScorer> makeHostScorer();

// Changes of an eye's last pictures, square by square.
class SquareHistory {
public:
    void forget() { m_known = 0; }

    // Adds up the squares of a picture, row by row, and remembers them.
    void add(std::span<const SquareSums> squares, uint32_t width, uint32_t height, PictureScores& scores);

private:
    // Changes of each square of the last pictures, oldest first, root mean squares over its pixels and channels.
    struct Changes {
        std::vector<double> before, now, after;

        void add(std::span<const SquareSums> squares, double SquareSums::*sum, uint32_t width, uint32_t height);
        // The most by which a square's change in the middle is above both others.
        [[nodiscard]] double pop() const;
    };

    uint32_t m_width = 0, m_height = 0;
    Changes m_picture, m_error;
    uint32_t m_known = 0; // pictures of this size in a row
};

// Squares of 16 pixels along a side.
constexpr uint32_t squaresAlong(uint32_t pixels)
{
    return (pixels + kScoreSquare - 1) / kScoreSquare;
}

} // namespace gsc
