// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_set.h"

#include <algorithm>
#include <numeric>

namespace gsc {

GaussianSet pick(const GaussianSet& set, std::span<const uint32_t> which)
{
    GaussianSet some;
    some.degree = set.degree;
    const auto copy = [which](const std::vector<float>& from, std::vector<float>& to, size_t each) {
        to.reserve(which.size() * each);
        for (const uint32_t i : which)
            to.insert(to.end(), from.data() + i * each, from.data() + (i + 1) * each);
    };
    copy(set.position, some.position, 3);
    copy(set.log_scale, some.log_scale, 3);
    copy(set.rotation, some.rotation, 4);
    copy(set.opacity, some.opacity, 1);
    copy(set.color, some.color, set.colorValues());
    return some;
}

void append(GaussianSet& set, const GaussianSet& part)
{
    const auto each = [&](const auto& does) {
        does(set.position, part.position);
        does(set.log_scale, part.log_scale);
        does(set.rotation, part.rotation);
        does(set.opacity, part.opacity);
        does(set.color, part.color);
        does(set.score, part.score);
        does(set.level, part.level);
        does(set.shown, part.shown);
    };
    // all memory first, so that a set that memory does not hold stays whole
    each([](auto& to, const auto& from) {
        if (const size_t size = to.size() + from.size(); size > to.capacity())
            to.reserve(std::max(size, 2 * to.capacity()));
    });
    set.degree = part.degree;
    each([](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); });
}

void keepOnly(GaussianSet& set, std::span<const uint32_t> which)
{
    const size_t colors = set.colorValues();
    const auto compact = [which](auto& values, size_t each) {
        if (values.empty())
            return;
        for (size_t i = 0; i < which.size(); ++i)
            std::copy_n(values.begin() + std::ptrdiff_t(which[i] * each), each,
                        values.begin() + std::ptrdiff_t(i * each));
        values.resize(which.size() * each);
    };
    compact(set.position, 3);
    compact(set.log_scale, 3);
    compact(set.rotation, 4);
    compact(set.opacity, 1);
    compact(set.color, colors);
    compact(set.score, 1);
    compact(set.level, 1);
    compact(set.shown, 1);
}

void keepBest(GaussianSet& set, size_t most)
{
    if (set.size() <= most)
        return;
    std::vector<uint32_t> kept(set.size());
    std::iota(kept.begin(), kept.end(), 0u);
    const auto better = [&](uint32_t a, uint32_t b) {
        return set.score[a] != set.score[b] ? set.score[a] > set.score[b] : a < b;
    };
    std::nth_element(kept.begin(), kept.begin() + std::ptrdiff_t(most), kept.end(), better);
    kept.resize(most);
    std::sort(kept.begin(), kept.end());
    keepOnly(set, kept);
}

} // namespace gsc
