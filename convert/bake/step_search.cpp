// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/step_search.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr double kTolerance = 0.12; // dB by which the result may be off the margin that is aimed at
constexpr uint32_t kMostProbes = 9;
constexpr size_t kCalibrationPoses = 3;
// trial bakes before the search: features, offsets, scales, networks, and leaving out slots and anchors
constexpr uint32_t kCalibrations = 5;

class Search {
public:
    explicit Search(const SearchTask& task) : m_task(task) {}

    SearchResult run()
    {
        if (m_task.from != nullptr) {
            m_result.plan = *m_task.from;
            turn();
            return std::move(m_result);
        }
        m_result.plan.levers = m_task.levers;
        // first guess: the squared error that the target allows, spread evenly over all values
        const double mse = std::pow(10.0, -(m_task.target + m_task.margin) / 10);
        const ModelParams& p = m_task.params;
        const double values = double(m_task.anchors) * (p.feat_dim + 3.0 * p.n_offsets + 6);
        m_result.plan.error = 12 * mse * 3 * double(m_task.weight_pixels) / values;
        calibrate();
        if (m_task.levers & kLeverNetworks)
            judgeNetworks(mse);
        turn();
        return std::move(m_result);
    }

private:
    // Decibels that a score has above the target, or above the least PSNR of a view, whichever is less.
    double margin(const SetScore& score) const
    {
        return std::min(score.psnr - m_task.target, score.worstPose().psnr - m_task.min_view);
    }

    // Summed squared error over the pixels of the poses for weights when only `levers` are used. It is estimated from a
    // few poses of the search.
    double errorOf(uint32_t levers)
    {
        BakePlan plan = m_result.plan;
        plan.levers = levers;
        const SetScore score = m_task.score(plan, 0, std::min(kCalibrationPoses, m_task.poses));
        return score.mse * 3 * double(m_task.weight_pixels);
    }

    // Corrects the cost factors: rounds features, offsets and scales one kind after the other, and compares the error
    // with the expected one.
    void calibrate()
    {
        const ModelParams& p = m_task.params;
        const double anchors = double(m_task.anchors), error = m_result.plan.error;
        ErrorCosts& costs = m_result.plan.costs;
        // slots stay masked and anchors left out in every trial: rounded features could otherwise make hidden slots
        // visible
        const uint32_t always = m_task.levers & (kLeverSlots | kLeverAnchors | kLeverCompact);
        const double base = always != 0 ? errorOf(always) : 0;
        const auto adjust = [&](uint32_t lever, double values, auto&&... cost) {
            if (!(m_task.levers & lever))
                return;
            const double factor = (errorOf(always | lever) - base) / (values * error / 12);
            if (factor > 0 && std::isfinite(factor))
                ((cost *= std::clamp(factor, 1e-3, 1e3)), ...);
        };
        adjust(kLeverFeatures, anchors * p.feat_dim, costs.feature);
        adjust(kLeverOffsets, anchors * p.n_offsets * 3, costs.place);
        adjust(kLeverScales, anchors * 6, costs.size);
    }

    // Rounds networks to half precision only if that costs less than a tenth of the allowed error.
    void judgeNetworks(double mse)
    {
        if (errorOf(kLeverNetworks) > 0.1 * mse * 3 * double(m_task.weight_pixels))
            m_result.plan.levers &= ~uint32_t(kLeverNetworks);
    }

    SetScore probe(double log_error)
    {
        m_result.plan.error = std::exp2(log_error);
        ++m_result.probes;
        return m_task.score(m_result.plan, 0, m_task.poses);
    }

    // Tries plans until the score is close to the aim. PSNR falls nearly linearly with the logarithm of the error; so
    // the next plan is where the line through the last two scores meets the aim, but between the finest plan that was
    // too coarse and the coarsest that was fine enough.
    void turn()
    {
        double at = std::log2(m_result.plan.error), slope = -3.0103;
        double fine = -INFINITY, coarse = INFINITY, best = NAN;
        double last_at = NAN, last = NAN;
        while (m_result.probes < kMostProbes) {
            const SetScore score = probe(at);
            const double m = margin(score);
            if (m >= m_task.margin - kTolerance) {
                fine = at;
                best = at;
                m_result.score = score;
                m_result.kept = true;
                if (m <= m_task.margin + kTolerance)
                    return;
            } else {
                coarse = at;
                if (!m_result.kept)
                    m_result.score = score;
            }
            if (std::isfinite(last) && last_at != at && std::isfinite(m))
                slope = std::clamp((m - last) / (at - last_at), -6.0, -0.5);
            last = m;
            last_at = at;
            double next = std::isfinite(m) ? at + (m_task.margin - m) / slope : at + (m > 0 ? 4 : -4);
            next = std::clamp(next, at - 12, at + 12);
            if (std::isfinite(fine) && std::isfinite(coarse) && !(next > fine && next < coarse))
                next = (fine + coarse) / 2;
            if (std::isfinite(fine) && std::isfinite(coarse) && coarse - fine < 0.02)
                break;
            at = next;
        }
        if (m_result.kept)
            m_result.plan.error = std::exp2(best); // the plan tried last may be too coarse
    }

    const SearchTask& m_task;
    SearchResult m_result;
};

} // namespace

SearchResult searchSteps(const SearchTask& task)
{
    return Search(task).run();
}

size_t searchPictures(size_t poses)
{
    return kCalibrations * std::min(kCalibrationPoses, poses) + 4 * poses; // a search usually scores about four plans
}

} // namespace gsc
