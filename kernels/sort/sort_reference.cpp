// SPDX-License-Identifier: Apache-2.0
#include "kernels/sort/sort.h"

#include <algorithm>
#include <numeric>

namespace gsc {

template <typename Real>
std::vector<uint32_t> sortReference(const std::vector<SplatOf<Real>>& splats)
{
    std::vector<uint32_t> indices(splats.size());
    std::iota(indices.begin(), indices.end(), 0u);
    std::sort(indices.begin(), indices.end(), [&splats](uint32_t a, uint32_t b) {
        const SplatOf<Real>&l = splats[a], &r = splats[b];
        return l.depth != r.depth ? l.depth < r.depth : l.order < r.order;
    });
    return indices;
}

template std::vector<uint32_t> sortReference<float>(const std::vector<SplatOf<float>>&);
template std::vector<uint32_t> sortReference<double>(const std::vector<SplatOf<double>>&);

} // namespace gsc
