// SPDX-License-Identifier: Apache-2.0
#include "convert/export/symmetric.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

bool solveSymmetric(double* a, double* b, size_t n, size_t columns)
{
    const auto row = [a](size_t i) { return a + i * (i + 1) / 2; };
    for (size_t i = 0; i < n; ++i)
        for (size_t j = 0; j <= i; ++j) {
            double sum = row(i)[j];
            for (size_t k = 0; k < j; ++k)
                sum -= row(i)[k] * row(j)[k];
            if (i != j)
                row(i)[j] = sum / row(j)[j];
            else if (sum > 0)
                row(i)[i] = std::sqrt(sum);
            else
                return false;
        }
    for (size_t c = 0; c < columns; ++c) {
        for (size_t i = 0; i < n; ++i) {
            for (size_t k = 0; k < i; ++k)
                b[i * columns + c] -= row(i)[k] * b[k * columns + c];
            b[i * columns + c] /= row(i)[i];
        }
        for (size_t i = n; i-- > 0;) {
            for (size_t k = i + 1; k < n; ++k)
                b[i * columns + c] -= row(k)[i] * b[k * columns + c];
            b[i * columns + c] /= row(i)[i];
        }
    }
    return true;
}

void ellipsoidAxes(const double covariance[6], double rotation[4], double deviation[3])
{
    double a[3][3] = {{covariance[0], covariance[1], covariance[2]},
                      {covariance[1], covariance[3], covariance[4]},
                      {covariance[2], covariance[4], covariance[5]}};
    glm::dmat3 axes(1);         // the axes found so far, one per column
    constexpr int kSweeps = 12; // six sweeps are enough for any 3 x 3 matrix
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (size_t p = 0; p < 2; ++p)
            for (size_t q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0)
                    continue;
                const double slope = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (slope < 0 ? -1 : 1) / (std::abs(slope) + std::sqrt(slope * slope + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (auto& r : a) { // rotates columns p and q
                    const double x = r[p], y = r[q];
                    r[p] = c * x - s * y;
                    r[q] = s * x + c * y;
                }
                for (size_t i = 0; i < 3; ++i) { // rotates rows p and q
                    const double x = a[p][i], y = a[q][i];
                    a[p][i] = c * x - s * y;
                    a[q][i] = s * x + c * y;
                }
                const glm::dvec3 first = axes[int(p)], second = axes[int(q)];
                axes[int(p)] = c * first - s * second;
                axes[int(q)] = s * first + c * second;
            }
    for (size_t i = 0; i < 3; ++i)
        deviation[i] = std::sqrt(std::max(a[i][i], 0.0));
    const glm::dquat turned = glm::normalize(glm::quat_cast(axes)); // a product of rotations, so never a mirror image
    rotation[0] = turned.w;
    rotation[1] = turned.x;
    rotation[2] = turned.y;
    rotation[3] = turned.z;
}

} // namespace gsc
