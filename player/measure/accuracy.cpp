// SPDX-License-Identifier: Apache-2.0
#include "player/measure/accuracy.h"

#include "player/report/report_parts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace gsc {

namespace {

// Adds the score of an image. A pixel that is no number makes it as bad as can be, `worst`.
template <typename Worse>
void addScore(Accuracy::Sampled& sampled, std::vector<double>& scores, uint32_t eye, double score, Worse worse,
              double worst)
{
    const double known = std::isnan(score) ? worst : score;
    if (scores.empty() || worse(known, sampled.worst))
        sampled.worst = known;
    scores.push_back(score);
    sampled.frames += eye == 0;
}

double meanOf(const std::vector<double>& values)
{
    return values.empty() ? 0 : std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Adds a value of an image; not a number counts as the worst.
void note(Accuracy::Changes& changes, std::vector<double>& values, uint64_t frame, double value)
{
    if (std::isnan(value))
        value = kWorstError;
    if (values.empty() || value > changes.max) {
        changes.max = value;
        changes.max_frame = frame;
    }
    values.push_back(value);
}

void rank(Accuracy::Changes& changes, std::vector<double> values)
{
    if (values.empty())
        return;
    double squares = 0;
    for (const double value : values)
        squares += value * value;
    std::sort(values.begin(), values.end());
    changes.images = values.size();
    changes.rms = std::sqrt(squares / double(values.size()));
    changes.p50 = nearestRank(values, 0.5);
    changes.p90 = nearestRank(values, 0.9);
    changes.p99 = nearestRank(values, 0.99);
}

} // namespace

double Scorer::change(uint32_t eye, const ImageView& image, const ImageView& exact)
{
    if (m_last.size() <= eye)
        m_last.resize(eye + 1);
    ErrorImage& last = m_last[eye];
    const bool comparable = last.width == image.width && last.height == image.height;
    const size_t count = size_t(image.width) * image.height * 3;
    last.width = image.width;
    last.height = image.height;
    last.values.resize(count);
    double sum = 0;
    for (size_t i = 0; i < count; ++i) {
        const float error = image.pixels[i] - exact.pixels[i];
        const double step = double(error) - double(last.values[i]);
        sum += step * step;
        last.values[i] = error;
    }
    if (!comparable || count == 0)
        return kNaN;
    return std::isnan(sum) ? kWorstError : std::sqrt(sum / double(count));
}

// Squares that reach over the edge are as much as is there of them.
void Scorer::move(uint64_t frame, uint32_t eye, const ImageView& image)
{
    constexpr uint32_t kSquare = 16;
    if (m_moves.size() <= eye)
        m_moves.resize(eye + 1);
    Movement& eye_moves = m_moves[eye];
    const size_t count = size_t(image.width) * image.height * 3;
    if (eye_moves.width != image.width || eye_moves.height != image.height)
        eye_moves.known = 0;
    eye_moves.width = image.width;
    eye_moves.height = image.height;
    if (eye_moves.known > 0 && count > 0) {
        const uint32_t columns = (image.width + kSquare - 1) / kSquare, rows = (image.height + kSquare - 1) / kSquare;
        eye_moves.before.swap(eye_moves.now);
        eye_moves.now.swap(eye_moves.after);
        eye_moves.after.assign(size_t(columns) * rows, 0);
        double sum = 0;
        for (uint32_t y = 0; y < image.height; ++y)
            for (uint32_t x = 0; x < image.width; ++x) {
                const size_t at = (size_t(y) * image.width + x) * 3;
                double square = 0;
                for (size_t c = at; c < at + 3; ++c) {
                    const double step = double(image.pixels[c]) - double(eye_moves.last[c]);
                    square += step * step;
                }
                eye_moves.after[size_t(y / kSquare) * columns + x / kSquare] += square;
                sum += square;
            }
        note(m_sums.motion, m_motion, frame, std::sqrt(sum / double(count)));
        for (uint32_t row = 0; row < rows; ++row)
            for (uint32_t column = 0; column < columns; ++column) {
                const uint32_t w = std::min(kSquare, image.width - column * kSquare);
                const uint32_t h = std::min(kSquare, image.height - row * kSquare);
                double& value = eye_moves.after[size_t(row) * columns + column];
                value = std::sqrt(value / (3.0 * w * h));
            }
        if (eye_moves.known > 2) { // three changes, the one in the middle is that of the frame before this one
            double most = 0;
            for (size_t i = 0; i < eye_moves.now.size(); ++i)
                most = std::max(most, eye_moves.now[i] - std::max(eye_moves.before[i], eye_moves.after[i]));
            note(m_sums.pop, m_pop, frame - 1, most);
        }
    }
    ++eye_moves.known;
    eye_moves.last.assign(image.pixels, image.pixels + count);
}

void Scorer::add(uint64_t frame, uint32_t eye, const ImageView& image, const ImageView& exact, const EyeGaze* gaze)
{
    const ImageDifference difference = compareImages(image, exact);
    const double changed = change(eye, image, exact);
    move(frame, eye, image);
    if (m_sums.frame_psnr.size() <= frame) {
        m_sums.frame_psnr.push_back(difference.psnr);
        m_sums.frame_temporal.push_back(changed);
    } else {
        m_sums.frame_psnr[frame] = std::min(m_sums.frame_psnr[frame], difference.psnr);
        m_sums.frame_temporal[frame] = std::max(m_sums.frame_temporal[frame], changed);
    }
    if (m_sums.images == 0 || difference.psnr < m_sums.psnr_min) {
        m_sums.psnr_min = difference.psnr;
        m_sums.psnr_min_frame = frame;
    }
    ++m_sums.images;
    m_psnr.push_back(difference.psnr);
    m_mse += difference.mse;
    m_sums.max_error = std::max(m_sums.max_error, difference.max_error);
    m_sums.over_1_255 += difference.over_1_255;

    if (!std::isnan(changed))
        note(m_sums.temporal, m_temporal, frame, changed);
    const auto isDue = [&](uint32_t every) { return every > 0 && frame % every == 0; };
    if (isDue(m_options.ssim_every))
        addScore(m_sums.ssim, m_ssim, eye, ssim(image, exact), std::less<>(), 0);
    m_flip_map.clear();
    if (isDue(m_options.flip_every)) {
        m_flip_map.resize(gaze ? size_t(image.width) * image.height : 0);
        addScore(m_sums.flip, m_flip, eye, flip(exact, image, kFlipPixelsPerDegree, m_flip_map), std::greater<>(), 1);
    }
    if (gaze)
        m_fovea.add(frame, image, exact, *gaze, m_flip_map);
}

Accuracy Scorer::result() const
{
    Accuracy result = m_sums;
    if (result.images == 0)
        return result;
    std::vector<double> psnr = m_psnr;
    std::sort(psnr.begin(), psnr.end());
    const double mse = m_mse / double(result.images);
    result.psnr_pooled = mse > 0 ? -10 * std::log10(mse) : std::numeric_limits<double>::infinity();
    result.psnr_p1 = nearestRank(psnr, 0.01);
    result.ssim.mean = meanOf(m_ssim);
    result.flip.mean = meanOf(m_flip);
    rank(result.temporal, m_temporal);
    rank(result.motion, m_motion);
    rank(result.pop, m_pop);
    if (!m_fovea.empty())
        result.fovea = m_fovea.result();
    return result;
}

} // namespace gsc
