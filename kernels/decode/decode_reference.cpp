// SPDX-License-Identifier: Apache-2.0
#include "kernels/decode/decode.h"

namespace gsc {

template <typename Real>
std::vector<GaussianOf<Real>> decodeReference(const ModelView& model, const Real* center,
                                              const std::vector<SelectedAnchor<Real>>& selected, int32_t appearance,
                                              bool& any_positive)
{
    std::vector<Real> scratch(decodeScratch(*model.params));
    std::vector<GaussianOf<Real>> gaussians;
    any_positive = false;
    for (const SelectedAnchor<Real>& anchor : selected)
        any_positive |=
            decodeAnchor<Real>(model, center, anchor.chunk, anchor.local, anchor.fraction, appearance, scratch.data(),
                               [&gaussians](const GaussianOf<Real>& g) { gaussians.push_back(g); });
    return gaussians;
}

template std::vector<GaussianOf<float>>
decodeReference<float>(const ModelView&, const float*, const std::vector<SelectedAnchor<float>>&, int32_t, bool&);
template std::vector<GaussianOf<double>>
decodeReference<double>(const ModelView&, const double*, const std::vector<SelectedAnchor<double>>&, int32_t, bool&);

} // namespace gsc
