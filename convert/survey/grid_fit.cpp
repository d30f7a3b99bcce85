// SPDX-License-Identifier: Apache-2.0
#include "convert/survey/grid_fit.h"

#include <gsc/interrupt.h>

#include <algorithm>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdlib>

namespace gsc {

namespace {

// How many quanta below and above the smallest coordinate the origin is searched for: with the checkpoint's voxel size,
// and, because there are several, with each voxel size found from the coordinates. Trainers start with 2^9 to 2^14
// cells per axis.
constexpr int64_t kOriginReach = 1 << 20, kRecoveredReach = 1 << 16;
constexpr size_t kMaxCandidates = 32; // most floats that are tried in an interval

double ulp(double value)
{
    return std::ldexp(1.0, std::max(std::ilogb(std::max(std::fabs(value), 1e-37)), -126) - 23);
}

bool fitsAll(std::span<const GridSample> samples, std::span<const float> quantum, int32_t level_min, float origin)
{
    return std::all_of(samples.begin(), samples.end(), [&](const GridSample& s) {
        return locateOnGrid(s.value, quantum[size_t(s.level - level_min)], origin).has_value();
    });
}

// The floats in [low, high], those nearest to the middle first, at most kMaxCandidates.
std::vector<float> floatsAround(double low, double high)
{
    std::vector<float> result;
    const float middle = float(0.5 * (low + high));
    float below = middle, above = std::nextafter(middle, FLT_MAX);
    while (result.size() < kMaxCandidates && (double(below) >= low || double(above) <= high)) {
        if (double(below) >= low && double(below) <= high)
            result.push_back(below);
        if (double(above) <= high && double(above) >= low)
            result.push_back(above);
        below = std::nextafter(below, -FLT_MAX);
        above = std::nextafter(above, FLT_MAX);
    }
    return result;
}

struct Gap {
    double size = 0;      // 0 = none was found
    double tolerance = 0; // largest error of `size`, as a share of it
};

// Smallest difference of neighbouring values that is no rounding error, averaged over all differences up to 1.4 times
// as large.
Gap smallestGap(std::span<const double> sorted, double noise)
{
    const auto noiseAt = [&](size_t i) { return std::max(noise, ulp(sorted[i])); };
    double smallest = INFINITY;
    for (size_t i = 1; i < sorted.size(); ++i) {
        const double gap = sorted[i] - sorted[i - 1];
        if (gap > 8 * noiseAt(i))
            smallest = std::min(smallest, gap);
    }
    double sum = 0, worst = 0;
    size_t count = 0;
    for (size_t i = 1; i < sorted.size(); ++i)
        if (const double gap = sorted[i] - sorted[i - 1]; gap >= smallest && gap < 1.4 * smallest) {
            sum += gap;
            worst = std::max(worst, noiseAt(i));
            ++count;
        }
    if (count == 0)
        return {};
    const double mean = sum / double(count);
    return {mean, std::clamp(2 * worst / mean, 1e-6, 0.25)};
}

struct Interval {
    double low, high;
    [[nodiscard]] bool empty() const { return !(low <= high); }
};

// Interval of quanta q for which each distance is a multiple k_i * q within its error. `guess` is right to within the
// share `tolerance`.
// note: distances must ascend: each has only one possible k_i by then, because those before it have narrowed q
Interval narrowQuantum(std::span<const double> distances, double guess, double tolerance, double fixed_error)
{
    Interval q{guess * (1 - tolerance), guess * (1 + tolerance)};
    for (const double d : distances) {
        const double k = std::round(d / (0.5 * (q.low + q.high)));
        if (k < 1 || d / q.low - d / q.high > 0.8)
            continue;
        const double error = fixed_error > 0 ? fixed_error : 0.51 * ulp(d);
        q.low = std::max(q.low, (d - error) / k);
        q.high = std::min(q.high, (d + error) / k);
        if (q.empty())
            break;
    }
    return q;
}

// Values that the quantum of one level may have, most likely first, found from its coordinates alone.
std::vector<float> recoverQuantum(std::span<const GridSample> samples, int32_t level, bool has_origin)
{
    std::vector<double> values;
    for (const GridSample& s : samples)
        if (s.level == level)
            values.push_back(has_origin ? double(s.value) : std::fabs(double(s.value)));
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    if (values.empty())
        return {};

    // with an unknown origin, a difference has the rounding errors of two coordinates and of two products before the
    // origin was added, which are larger than the coordinates
    const double noise = has_origin ? 2 * ulp(4 * std::max(std::fabs(values.front()), std::fabs(values.back()))) : 0;
    Gap gap = smallestGap(values, noise);
    if (!has_origin) {
        // the smallest value above zero is a multiple too, and the most precise one
        const auto first = std::upper_bound(values.begin(), values.end(), 0.0);
        if (first == values.end())
            return {};
        if (gap.size == 0 || *first < gap.size * (1 - gap.tolerance))
            gap = {*first, 1e-6};
    }
    // note: the values of floats lie on a grid of their own, that of their last place, which is not the one wanted
    if (!(gap.size > 16 * ulp(std::max(std::fabs(values.front()), std::fabs(values.back())))))
        return {};
    const double start = has_origin ? values.front() : 0;
    std::vector<double> distances;
    for (const double v : values)
        if (v > start)
            distances.push_back(v - start);

    std::vector<float> candidates;
    // the smallest difference in the sample may be several quanta
    for (int divisor = 1; divisor <= 16 && candidates.empty(); ++divisor) {
        const Interval q = narrowQuantum(distances, gap.size / divisor, gap.tolerance, noise);
        if (!q.empty() && q.high - q.low < 1e-5 * q.high)
            candidates = floatsAround(q.low, q.high);
    }
    return candidates;
}

class OriginSearch {
public:
    OriginSearch(std::span<const GridSample> samples, std::span<const float> quantum, int32_t level_min, int64_t reach)
        : m_samples(samples), m_quantum(quantum), m_level_min(level_min), m_reach(reach)
    {
    }

    std::optional<float> run()
    {
        if (!findPhase())
            return std::nullopt;
        double smallest = INFINITY;
        for (const GridSample& s : m_samples)
            smallest = std::min(smallest, double(s.value));
        // the trainers put the origin below or a little above the smallest coordinate
        const double base = m_phase + m_step * std::floor((smallest - m_phase) / m_step);
        for (int64_t distance = 0; distance <= m_reach; ++distance) {
            if (distance % 4096 == 0)
                throwIfInterrupted();
            for (const int64_t j : {-distance, distance}) {
                if (const std::optional<float> origin = tryNear(base + m_step * double(j)))
                    return origin;
                if (distance == 0)
                    break;
            }
        }
        return std::nullopt;
    }

private:
    [[nodiscard]] float quantumOf(const GridSample& s) const { return m_quantum[size_t(s.level - m_level_min)]; }

    // Finds the origin modulo the coarsest quantum in the sample; returns false if the coordinates contradict each
    // other.
    bool findPhase()
    {
        double reference = 0;
        for (const GridSample& s : m_samples)
            if (quantumOf(s) > m_step) {
                m_step = quantumOf(s);
                reference = s.value;
            }
        double sum = 0, low = 0, high = 0, largest = 0;
        size_t count = 0;
        for (const GridSample& s : m_samples) {
            if (double(quantumOf(s)) != m_step)
                continue;
            const double d = double(s.value) - reference;
            const double rest = d - m_step * std::round(d / m_step);
            low = std::min(low, rest);
            high = std::max(high, rest);
            largest = std::max(largest, std::fabs(double(s.value)));
            sum += rest;
            ++count;
        }
        m_phase = reference + sum / double(count);
        m_tolerance = 2 * (high - low) + 16 * ulp(4 * largest);
        return high - low < 0.5 * m_step;
    }

    // Returns an origin close to `center` with which all samples are reproduced. m_samples are ordered by magnitude:
    // small ones fix the origin best, so a wrong `center` is given up after a few.
    std::optional<float> tryNear(double center)
    {
        const double reach = std::min(m_tolerance + 2 * ulp(center), 0.5 * m_step);
        Interval origin{center - reach, center + reach};
        for (const GridSample& s : m_samples) {
            const float quantum = quantumOf(s);
            const double k = std::round((double(s.value) - center) / double(quantum));
            if (std::fabs(k) >= kMaxQuanta)
                return std::nullopt;
            const double product = float(k) * quantum;
            const double value = s.value;
            origin.low = std::max(origin.low, 0.5 * (value + double(std::nextafter(s.value, -FLT_MAX))) - product);
            origin.high = std::min(origin.high, 0.5 * (value + double(std::nextafter(s.value, FLT_MAX))) - product);
            if (origin.empty())
                return std::nullopt;
        }
        for (const float candidate : floatsAround(origin.low, origin.high))
            if (fitsAll(m_samples, m_quantum, m_level_min, candidate))
                return candidate;
        return std::nullopt;
    }

    std::span<const GridSample> m_samples;
    std::span<const float> m_quantum;
    int32_t m_level_min;
    int64_t m_reach;
    double m_step = 0, m_phase = 0, m_tolerance = 0;
};

} // namespace

std::optional<GridPoint> locateOnGrid(float value, float quantum, float origin)
{
    const double k = std::round((double(value) - double(origin)) / double(quantum));
    if (!(std::fabs(k) < kMaxQuanta))
        return std::nullopt;
    // -0.0 is stored as quantum 0 with a flag, so the grid must reach zero
    const bool negative_zero = value == 0 && std::signbit(value);
    const uint32_t stored = std::bit_cast<uint32_t>(negative_zero ? 0.0f : value);
    // tries neighbours, too, because the rounding of k can be off where a quantum is about as small as a unit in the
    // last place
    for (const int64_t quanta : {int64_t(k), int64_t(k) - 1, int64_t(k) + 1})
        if (std::abs(quanta) < kMaxQuanta &&
            std::bit_cast<uint32_t>(gridCoordinate(int32_t(quanta), quantum, origin, false)) == stored)
            return GridPoint{int32_t(quanta), negative_zero};
    return std::nullopt;
}

float levelQuantum(float voxel_size, uint32_t fork, int32_t level)
{
    return voxel_size / float(std::pow(double(fork), double(level)));
}

std::optional<Grid> fitGrid(std::vector<GridSample>& samples, const GridHints& hints)
{
    std::sort(samples.begin(), samples.end(), [](const GridSample& a, const GridSample& b) {
        const float x = std::fabs(a.value), y = std::fabs(b.value);
        return x != y ? x < y : a.value != b.value ? a.value < b.value : a.level < b.level;
    });
    samples.erase(
        std::unique(samples.begin(), samples.end(),
                    [](const GridSample& a, const GridSample& b) { return a.value == b.value && a.level == b.level; }),
        samples.end());
    if (samples.empty())
        return std::nullopt;
    const auto [low, high] = std::minmax_element(
        samples.begin(), samples.end(), [](const GridSample& a, const GridSample& b) { return a.level < b.level; });
    const int32_t level_min = low->level, level_max = high->level;

    std::vector<float> quantum(size_t(level_max - level_min) + 1);
    const auto tryVoxelSize = [&](float voxel_size, int64_t reach) -> std::optional<Grid> {
        for (int32_t level = level_min; level <= level_max; ++level) {
            const float q = levelQuantum(voxel_size, hints.fork, level);
            if (!(q >= FLT_MIN && q <= FLT_MAX))
                return std::nullopt;
            quantum[size_t(level - level_min)] = q;
        }
        if (fitsAll(samples, quantum, level_min, 0.0f))
            return Grid{voxel_size, 0.0f};
        if (!hints.may_have_origin)
            return std::nullopt;
        if (const std::optional<float> origin = OriginSearch(samples, quantum, level_min, reach).run())
            return Grid{voxel_size, *origin};
        return std::nullopt;
    };

    if (hints.voxel_size > 0)
        if (const std::optional<Grid> grid = tryVoxelSize(hints.voxel_size, kOriginReach))
            return grid;
    if (hints.fixed)
        return std::nullopt;
    for (const bool has_origin : {false, true}) {
        if (has_origin && !hints.may_have_origin)
            break;
        for (const float q : recoverQuantum(samples, level_min, has_origin)) {
            const float voxel_size = q * float(std::pow(double(hints.fork), double(level_min)));
            if (const std::optional<Grid> grid = tryVoxelSize(voxel_size, kRecoveredReach))
                return grid;
        }
    }
    return std::nullopt;
}

} // namespace gsc
