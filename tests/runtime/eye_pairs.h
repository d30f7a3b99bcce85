// SPDX-License-Identifier: Apache-2.0
// Heads and eyes at random, for the tests of stereo.
#pragma once

#include <gsc/camera.h>
#include "tests/kernels/synthetic_model.h"

#include <algorithm>
#include <cmath>

namespace gsc::test {

// Rotation about a random axis by up to `most` radians, row-major.
inline void randomRotation(Random& random, float most, double* out)
{
    double axis[3], length = 0;
    for (double& a : axis) {
        a = double(random.normal());
        length += a * a;
    }
    const double angle = double(random.uniform(-most, most)), c = std::cos(angle), s = std::sin(angle);
    for (double& a : axis)
        a /= std::sqrt(length);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            const double cross = i == j ? 0 : ((j - i + 3) % 3 == 1 ? -1 : 1) * axis[3 - i - j];
            out[3 * i + j] = (i == j ? c : 0) + (1 - c) * axis[i] * axis[j] + s * cross;
        }
}

// Lens within `widest` radians of the axis, somewhere within `reach` of the head's middle, turned by up to `cant`.
inline EyeView randomView(Random& random, float widest, float reach, float cant)
{
    EyeView view;
    view.left = double(random.uniform(-widest, 0.8f * widest));
    view.right = double(random.uniform(float(view.left) + 0.1f, widest));
    view.down = double(random.uniform(-widest, 0.8f * widest));
    view.up = double(random.uniform(float(view.down) + 0.1f, widest));
    for (double& p : view.position)
        p = double(random.uniform(-reach, reach));
    randomRotation(random, cant, view.rotation);
    return view;
}

// A head anywhere within `reach`, looking anywhere.
inline Camera randomHead(Random& random, float reach, uint32_t width, uint32_t height)
{
    Camera head;
    randomRotation(random, 3.14f, head.rotation);
    for (double& t : head.translation)
        t = double(random.uniform(-reach, reach));
    head.width = width;
    head.height = height;
    return head;
}

} // namespace gsc::test
