// SPDX-License-Identifier: Apache-2.0
#include "convert/chart/pareto.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace gsc {

std::vector<size_t> paretoFront(std::span<const SpeedAccuracy> points)
{
    std::vector<size_t> order(points.size());
    std::iota(order.begin(), order.end(), size_t(0));
    std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
        return points[a].ms != points[b].ms ? points[a].ms < points[b].ms : points[a].psnr > points[b].psnr;
    });
    std::vector<size_t> front;
    double best = -std::numeric_limits<double>::infinity();
    for (const size_t i : order) {
        const bool same =
            !front.empty() && points[front.back()].ms == points[i].ms && points[front.back()].psnr == points[i].psnr;
        if (!front.empty() && !same && points[i].psnr <= best)
            continue;
        front.push_back(i);
        best = points[i].psnr;
    }
    return front;
}

std::vector<size_t> thinned(const std::vector<size_t>& indices, size_t count)
{
    if (indices.size() <= count)
        return indices;
    std::vector<size_t> kept;
    for (size_t i = 0; i < count; ++i)
        kept.push_back(indices[count == 1 ? 0 : i * (indices.size() - 1) / (count - 1)]);
    return kept;
}

} // namespace gsc
