// SPDX-License-Identifier: Apache-2.0
#include "kernels/project/project.h"

namespace gsc {

template <typename Real>
std::vector<SplatOf<Real>> projectReference(const EyeOf<Real>& eye, const RasterConstants& rules,
                                            const std::vector<GaussianOf<Real>>& gaussians, uint64_t& dropped)
{
    std::vector<SplatOf<Real>> splats;
    splats.reserve(gaussians.size());
    for (const GaussianOf<Real>& g : gaussians) {
        const Footprint<Real> f = projectGaussian<Real>(eye, rules, g);
        if (!f.finite) {
            ++dropped;
            continue;
        }
        if (!f.visible)
            continue;
        SplatOf<Real> s{};
        s.x = f.x;
        s.y = f.y;
        for (int i = 0; i < 3; ++i) {
            s.conic[i] = f.conic[i];
            s.color[i] = g.color[i];
        }
        s.opacity = g.opacity;
        s.depth = f.depth;
        s.tiles = f.tiles;
        s.order = g.order;
        splats.push_back(s);
    }
    return splats;
}

template std::vector<SplatOf<float>> projectReference<float>(const EyeParams&, const RasterConstants&,
                                                             const std::vector<GaussianOf<float>>&, uint64_t&);
template std::vector<SplatOf<double>> projectReference<double>(const EyeParams64&, const RasterConstants&,
                                                               const std::vector<GaussianOf<double>>&, uint64_t&);

} // namespace gsc
