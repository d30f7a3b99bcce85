// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/principal_axes.h"

#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

// Computes the axes by Jacobi rotations.
PrincipalAxes principalAxes(glm::dmat3 m)
{
    glm::dmat3 v(1);
    for (int sweep = 0; sweep < 32; ++sweep)
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (std::abs(m[q][p]) < 1e-300)
                    continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[q][p]);
                const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                glm::dmat3 turn(1);
                turn[p][p] = turn[q][q] = c;
                turn[q][p] = s;
                turn[p][q] = -s;
                m = transpose(turn) * (m * turn);
                v = v * turn;
            }
    PrincipalAxes found;
    int order[3] = {0, 1, 2};
    std::sort(order, order + 3, [&](int a, int b) { return m[a][a] > m[b][b]; });
    for (int i = 0; i < 3; ++i) {
        const glm::dvec3 axis = v[order[i]];
        // the sign must not depend on the order of the rotations
        const double largest = std::max({axis.x, axis.y, axis.z}), smallest = std::min({axis.x, axis.y, axis.z});
        found.axes[i] = axis * (largest >= -smallest ? 1.0 : -1.0);
        found.values[i] = m[order[i]][order[i]];
    }
    return found;
}

} // namespace gsc
