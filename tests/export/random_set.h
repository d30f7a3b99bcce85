// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "convert/export/gaussian_set.h"
#include "tests/kernels/synthetic_model.h"

#include <cmath>

namespace gsc::test {

inline GaussianSet randomSet(int degree, size_t count)
{
    Random random(7);
    GaussianSet set;
    set.degree = degree;
    for (size_t i = 0; i < count; ++i) {
        float q[4], length = 0;
        for (float& v : q) {
            v = random.normal();
            length += v * v;
        }
        for (const float v : q)
            set.rotation.push_back(v / std::sqrt(length));
        for (int c = 0; c < 3; ++c) {
            set.position.push_back(random.uniform(-40, 40));
            set.log_scale.push_back(random.uniform(-6, 0));
        }
        set.opacity.push_back(random.uniform(0.01f, 1));
        set.score.push_back(random.uniform());
        for (size_t c = 0; c < set.colorValues(); ++c)
            set.color.push_back(random.uniform(-0.9f, 0.9f));
    }
    return set;
}

} // namespace gsc::test
