// SPDX-License-Identifier: Apache-2.0
// Real spherical harmonics up to degree 3, as files of 3DGS have them: with the Condon-Shortley phase; the coefficients
// of degree l are in the order m = -l .. l.
#pragma once

#include <array>
#include <cstddef>

namespace gsc {

constexpr int kMostShDegree = 3;
constexpr size_t kMostShValues = size_t(kMostShDegree + 1) * (kMostShDegree + 1);

constexpr size_t shValues(int degree)
{
    return size_t(degree + 1) * size_t(degree + 1);
}

// Values of the harmonics up to `degree` in `direction`, a unit vector. Writes shValues(degree) floats to `out`.
inline void shBasis(int degree, const float* direction, float* out)
{
    const float x = direction[0], y = direction[1], z = direction[2];
    out[0] = 0.28209479177387814f;
    if (degree < 1)
        return;
    constexpr float k1 = 0.4886025119029199f;
    out[1] = -k1 * y;
    out[2] = k1 * z;
    out[3] = -k1 * x;
    if (degree < 2)
        return;
    const float xx = x * x, yy = y * y, zz = z * z;
    constexpr float k2 = 1.0925484305920792f;
    out[4] = k2 * x * y;
    out[5] = -k2 * y * z;
    out[6] = 0.31539156525252005f * (2 * zz - xx - yy);
    out[7] = -k2 * x * z;
    out[8] = 0.5462742152960396f * (xx - yy);
    if (degree < 3)
        return;
    constexpr float k3 = 0.5900435899266435f, k31 = 0.4570457994644658f;
    out[9] = -k3 * y * (3 * xx - yy);
    out[10] = 2.890611442640554f * x * y * z;
    out[11] = -k31 * y * (4 * zz - xx - yy);
    out[12] = 0.3731763325901154f * z * (2 * zz - 3 * xx - 3 * yy);
    out[13] = -k31 * x * (4 * zz - xx - yy);
    out[14] = 1.445305721320277f * z * (xx - yy);
    out[15] = -k3 * x * (xx - 3 * yy);
}

// Factors of the coefficients if the axes y and z change their signs.
constexpr std::array<float, kMostShValues> kShFlipYz = {1, -1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

} // namespace gsc
