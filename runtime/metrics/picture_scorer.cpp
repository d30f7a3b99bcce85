// SPDX-License-Identifier: Apache-2.0
#include "runtime/metrics/picture_scorer.h"

#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

// Number of pixels of the square at `column`, `row`, which may be cut at the picture's edge.
double pixelsOf(uint32_t column, uint32_t row, uint32_t width, uint32_t height)
{
    return double(std::min(kScoreSquare, width - column * kScoreSquare)) *
           std::min(kScoreSquare, height - row * kScoreSquare);
}

class HostScorer final : public PictureScorer {
public:
    PictureScores score(uint32_t eye, const PictureRef& image, const PictureRef& exact,
                        const ScoreRequest& request) override
    {
        const ImageView a{image.pixels, image.width, image.height}, b{exact.pixels, exact.width, exact.height};
        PictureScores scores;
        sumSquares(m_eyes[eye], a, b, request.gaze);
        m_eyes[eye].history.add(m_squares, a.width, a.height, scores);
        if (request.ssim)
            scores.ssim = ssim(a, b);
        if (request.flip)
            scoreFlip(a, b, request.gaze, scores);
        return scores;
    }

    void forget() override
    {
        for (Eye& eye : m_eyes)
            eye.history.forget();
    }

private:
    struct Eye {
        SquareHistory history;
        std::vector<float> last_error, last_image;
    };

    void sumSquares(Eye& eye, const ImageView& image, const ImageView& exact, const EyeGaze* gaze)
    {
        const uint32_t columns = squaresAlong(image.width);
        m_squares.assign(size_t(columns) * squaresAlong(image.height), {});
        eye.last_error.resize(size_t(image.width) * image.height * 3);
        eye.last_image.resize(eye.last_error.size());
        for (uint32_t y = 0; y < image.height; ++y)
            for (uint32_t x = 0; x < image.width; ++x) {
                const size_t at = (size_t(y) * image.width + x) * 3;
                addPixel(m_squares[size_t(y / kScoreSquare) * columns + x / kScoreSquare],
                         gaze != nullptr && inFovea(*gaze, x, y), image.pixels + at, exact.pixels + at,
                         eye.last_error.data() + at, eye.last_image.data() + at);
            }
    }

    void scoreFlip(const ImageView& image, const ImageView& exact, const EyeGaze* gaze, PictureScores& scores)
    {
        m_flip_map.resize(gaze != nullptr ? size_t(image.width) * image.height : 0);
        scores.flip = flip(exact, image, kFlipPixelsPerDegree, m_flip_map);
        if (gaze == nullptr)
            return;
        double sums[2] = {};
        for (uint32_t y = 0; y < image.height; ++y)
            for (uint32_t x = 0; x < image.width; ++x)
                sums[inFovea(*gaze, x, y) ? 0 : 1] += double(m_flip_map[size_t(y) * image.width + x]);
        for (size_t part = 0; part < 2; ++part)
            scores.fovea[part].flip = sums[part];
    }

    Eye m_eyes[kMaxEyes];
    std::vector<SquareSums> m_squares; // squares of the current picture, row by row
    std::vector<float> m_flip_map;
};

} // namespace

void SquareHistory::Changes::add(std::span<const SquareSums> squares, double SquareSums::*sum, uint32_t width,
                                 uint32_t height)
{
    before.swap(now);
    now.swap(after);
    after.resize(squares.size());
    const uint32_t columns = squaresAlong(width);
    for (size_t i = 0; i < squares.size(); ++i)
        after[i] =
            std::sqrt(squares[i].*sum / (3 * pixelsOf(uint32_t(i % columns), uint32_t(i / columns), width, height)));
}

double SquareHistory::Changes::pop() const
{
    double most = 0;
    for (size_t i = 0; i < now.size(); ++i)
        most = std::max(most, now[i] - std::max(before[i], after[i]));
    return most;
}

void SquareHistory::add(std::span<const SquareSums> squares, uint32_t width, uint32_t height, PictureScores& scores)
{
    SquareSums all{};
    for (const SquareSums& square : squares)
        addSums(all, square);
    const double values = 3.0 * width * height;
    scores.mse = values > 0 ? (all.error[0] + all.error[1]) / values : 0;
    scores.psnr = psnrOf(scores.mse);
    scores.max_error = all.largest;
    scores.over_1_255 = all.over_1_255;
    for (size_t part = 0; part < 2; ++part) {
        scores.fovea[part].pixels = all.pixels[part];
        scores.fovea[part].squares = all.error[part];
    }
    if (m_width != width || m_height != height)
        m_known = 0;
    m_width = width;
    m_height = height;
    if (m_known > 0 && values > 0) {
        scores.change = std::sqrt(all.change / values);
        scores.motion = std::sqrt(all.motion / values);
        m_picture.add(squares, &SquareSums::motion, width, height);
        m_error.add(squares, &SquareSums::change, width, height);
        if (m_known > 2) { // with four pictures three changes are known; the pop is that of the middle change
            scores.pop = m_picture.pop();
            scores.error_pop = m_error.pop();
        }
    }
    ++m_known;
}

std::unique_ptr<PictureScorer> makeHostScorer()
{
    return std::make_unique<HostScorer>();
}

} // namespace gsc
