// SPDX-License-Identifier: Apache-2.0
#include "player/accuracy.h"

#include "player/report_parts.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace gsc {

namespace {

// A pixel that is no number makes an image as bad as can be.
double numberOr(double value, double worst)
{
    return value == value ? value : worst;
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

constexpr double kWorstError = 1e30; // of a pixel that is not finite; JSON has no word for that

double bounded(double error)
{
    return error < kWorstError ? error : kWorstError;
}

// `nothing_alike`: the value of images that cannot be compared because a pixel is not finite.
OrderedJson sampledJson(const Accuracy::Sampled& sampled, const char* worst, double nothing_alike)
{
    if (sampled.frames == 0)
        return {};
    const auto value = [&](double v) { return std::isfinite(v) ? v : nothing_alike; };
    return {{"mean", value(sampled.mean)}, {worst, value(sampled.worst)}, {"frames", sampled.frames}};
}

OrderedJson temporalJson(const Accuracy::Temporal& temporal)
{
    if (temporal.images == 0)
        return {};
    return {{"rms", bounded(temporal.rms)},
            {"p50", bounded(temporal.p50)},
            {"p99", bounded(temporal.p99)},
            {"max", bounded(temporal.max)},
            {"max_frame", temporal.max_frame}};
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

void Scorer::add(uint64_t frame, uint32_t eye, const ImageView& image, const ImageView& exact)
{
    const ImageDifference difference = compareImages(image, exact);
    const double changed = change(eye, image, exact);
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

    if (!std::isnan(changed)) {
        if (m_changes.empty() || changed > m_sums.temporal.max) {
            m_sums.temporal.max = changed;
            m_sums.temporal.max_frame = frame;
        }
        m_changes.push_back(changed);
        m_change2 += changed * changed;
    }
    if (m_options.ssim_every > 0 && frame % m_options.ssim_every == 0) {
        const double value = ssim(image, exact);
        m_sums.ssim.worst = std::min(m_ssim_images == 0 ? 1.0 : m_sums.ssim.worst, numberOr(value, 0));
        m_ssim += value;
        ++m_ssim_images;
        m_sums.ssim.frames += eye == 0;
    }
    if (m_options.flip_every > 0 && frame % m_options.flip_every == 0) {
        const double value = flip(exact, image);
        m_sums.flip.worst = std::max(m_sums.flip.worst, numberOr(value, 1));
        m_flip += value;
        ++m_flip_images;
        m_sums.flip.frames += eye == 0;
    }
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
    if (m_ssim_images > 0)
        result.ssim.mean = m_ssim / double(m_ssim_images);
    if (m_flip_images > 0)
        result.flip.mean = m_flip / double(m_flip_images);
    if (!m_changes.empty()) {
        std::vector<double> changes = m_changes;
        std::sort(changes.begin(), changes.end());
        result.temporal.images = changes.size();
        result.temporal.rms = std::sqrt(m_change2 / double(changes.size()));
        result.temporal.p50 = nearestRank(changes, 0.5);
        result.temporal.p99 = nearestRank(changes, 0.99);
    }
    return result;
}

OrderedJson psnrJson(double psnr)
{
    constexpr double kWorstPsnr = -999;
    return psnr > kWorstPsnr ? finiteOrNull(psnr) : OrderedJson(kWorstPsnr);
}

nlohmann::ordered_json accuracyJson(const Accuracy& accuracy)
{
    return {{"psnr",
             {{"pooled", psnrJson(accuracy.psnr_pooled)},
              {"p1", psnrJson(accuracy.psnr_p1)},
              {"min", psnrJson(accuracy.psnr_min)},
              {"min_frame", accuracy.psnr_min_frame}}},
            {"max_error", bounded(accuracy.max_error)},
            {"over_1_255", accuracy.over_1_255},
            {"ssim", sampledJson(accuracy.ssim, "min", 0)},
            {"flip", sampledJson(accuracy.flip, "max", 1)},
            {"temporal", temporalJson(accuracy.temporal)}};
}

} // namespace gsc
