// SPDX-License-Identifier: Apache-2.0
#include "kernels/select/select.h"

#include "kernels/select/select_body.h"

namespace gsc {

template <typename Real>
std::vector<SelectedAnchor<Real>> selectReference(const ModelView& model, const EyeOf<Real>& eye,
                                                  const RasterConstants& rules, Real lod_bias, Real lod_fade)
{
    std::vector<SelectedAnchor<Real>> selected;
    for (uint64_t chunk = 0; chunk < model.params->chunk_count; ++chunk) {
        const Real shift = lodShift<Real>(*model.params, anchorLevel(model, uint32_t(chunk)));
        for (uint32_t local = 0; local < model.chunks[chunk].anchor_count; ++local) {
            const AnchorDecision<Real> decision =
                testAnchor<Real>(model, eye, rules, lod_bias, lod_fade, uint32_t(chunk), local, shift);
            if (decision.visible)
                selected.push_back({uint32_t(chunk), local, decision.fraction});
        }
    }
    return selected;
}

template std::vector<SelectedAnchor<float>> selectReference<float>(const ModelView&, const EyeParams&,
                                                                   const RasterConstants&, float, float);
template std::vector<SelectedAnchor<double>> selectReference<double>(const ModelView&, const EyeParams64&,
                                                                     const RasterConstants&, double, double);

} // namespace gsc
