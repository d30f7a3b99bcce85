// SPDX-License-Identifier: Apache-2.0
#include "player/measure/scorer.h"

#include "runtime/records/report_parts.h"
#include "runtime/metrics/metrics.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>

namespace gsc {

namespace {

// Adds the score of an image. A score that is NaN, from a pixel that is not finite, counts as `worst`.
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

// The change; kWorstError if it is NaN.
double worstIfBroken(double change)
{
    return std::isnan(change) ? kWorstError : change;
}

// Adds the change of an image.
void note(Accuracy::Changes& changes, std::vector<double>& values, uint64_t frame, double value)
{
    value = worstIfBroken(value);
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

void FoveaScorer::add(uint64_t frame, const FoveaSums (&sides)[2])
{
    for (size_t i = 0; i < 2; ++i) {
        const FoveaSums& own = sides[i];
        Sums& all = m_sums[i];
        if (own.pixels == 0)
            continue;
        const double psnr = psnrOf(own.squares / double(3 * own.pixels));
        if (all.pixels == 0 || psnr < all.psnr_min) {
            all.psnr_min = psnr;
            all.psnr_min_frame = frame;
        }
        all.pixels += own.pixels;
        all.squares += own.squares;
        if (own.flip) {
            all.flip_pixels += own.pixels;
            all.flip += *own.flip;
        }
    }
}

FoveaAccuracy FoveaScorer::result() const
{
    FoveaAccuracy result;
    const auto every = double(m_sums[0].pixels + m_sums[1].pixels);
    for (size_t i = 0; i < 2; ++i) {
        const Sums& sums = m_sums[i];
        FoveaAccuracy::Part& part = i == 0 ? result.inside : result.outside;
        if (sums.pixels == 0)
            continue;
        part.share = double(sums.pixels) / every;
        part.psnr_pooled = psnrOf(sums.squares / double(3 * sums.pixels));
        part.psnr_min = sums.psnr_min;
        part.psnr_min_frame = sums.psnr_min_frame;
        if (sums.flip_pixels > 0)
            part.flip = sums.flip / double(sums.flip_pixels);
    }
    return result;
}

Scorer::Scorer(const ScoreOptions& options, std::unique_ptr<PictureScorer> pictures)
    : m_options(options), m_pictures(std::move(pictures))
{
    m_sums.scored = options;
}

void Scorer::addChanges(uint64_t frame, const PictureScores& scores)
{
    if (scores.change)
        note(m_sums.temporal, m_temporal, frame, *scores.change);
    if (scores.motion)
        note(m_sums.motion, m_motion, frame, *scores.motion);
    if (scores.pop)
        note(m_sums.pop, m_pop, frame - 1, *scores.pop);
    if (scores.error_pop)
        note(m_sums.error_pop, m_error_pop, frame - 1, *scores.error_pop);
}

void Scorer::add(uint64_t frame, uint32_t eye, const PictureRef& image, const PictureRef& exact, const EyeGaze* gaze)
{
    const uint64_t number = m_options.placeOf(frame);
    const auto isDue = [&](uint32_t every) { return every > 0 && number % every == 0; };
    if (!m_options.inARow() && eye == 0)
        m_pictures->forget();
    const PictureScores scores =
        m_pictures->score(eye, image, exact, {isDue(m_options.ssim_every), isDue(m_options.flip_every), gaze});
    const double changed = scores.change ? worstIfBroken(*scores.change) : kNaN;
    if (m_sums.frame_psnr.size() <= number) {
        m_sums.frame_psnr.push_back(scores.psnr);
        m_sums.frame_temporal.push_back(changed);
    } else {
        m_sums.frame_psnr[number] = std::min(m_sums.frame_psnr[number], scores.psnr);
        m_sums.frame_temporal[number] = std::max(m_sums.frame_temporal[number], changed);
    }
    if (m_sums.images == 0 || scores.psnr < m_sums.psnr_min) {
        m_sums.psnr_min = scores.psnr;
        m_sums.psnr_min_frame = frame;
    }
    ++m_sums.images;
    m_psnr.push_back(scores.psnr);
    m_mse += scores.mse;
    m_sums.max_error = std::max(m_sums.max_error, scores.max_error);
    m_sums.over_1_255 += scores.over_1_255;
    addChanges(frame, scores);
    if (scores.ssim)
        addScore(m_sums.ssim, m_ssim, eye, *scores.ssim, std::less<>(), 0);
    if (scores.flip)
        addScore(m_sums.flip, m_flip, eye, *scores.flip, std::greater<>(), 1);
    if (gaze)
        m_fovea.add(frame, scores.fovea);
}

Accuracy Scorer::result() const
{
    Accuracy result = m_sums;
    if (result.images == 0)
        return result;
    std::vector<double> psnr = m_psnr;
    std::sort(psnr.begin(), psnr.end());
    result.psnr_pooled = psnrOf(m_mse / double(result.images));
    result.psnr_p1 = nearestRank(psnr, 0.01);
    result.ssim.mean = meanOf(m_ssim);
    result.flip.mean = meanOf(m_flip);
    rank(result.temporal, m_temporal);
    rank(result.motion, m_motion);
    rank(result.pop, m_pop);
    rank(result.error_pop, m_error_pop);
    if (!m_fovea.empty())
        result.fovea = m_fovea.result();
    return result;
}

} // namespace gsc
