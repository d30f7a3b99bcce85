// SPDX-License-Identifier: Apache-2.0
#include "convert/explicit/symmetric.h"

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

namespace {

// The quaternion of a rotation matrix whose columns are `axes`, by the largest of the four squares (Shepperd 1978).
void quaternionOf(const double (&m)[3][3], double q[4])
{
    const double squares[4] = {m[0][0] + m[1][1] + m[2][2], m[0][0] - m[1][1] - m[2][2], m[1][1] - m[0][0] - m[2][2],
                               m[2][2] - m[0][0] - m[1][1]};
    const auto largest = size_t(std::max_element(squares, squares + 4) - squares);
    const double root = std::sqrt(squares[largest] + 1), part = 0.5 / root;
    q[largest] = 0.5 * root;
    if (largest == 0) {
        q[1] = (m[2][1] - m[1][2]) * part;
        q[2] = (m[0][2] - m[2][0]) * part;
        q[3] = (m[1][0] - m[0][1]) * part;
        return;
    }
    const size_t i = largest - 1, j = (i + 1) % 3, k = (i + 2) % 3;
    q[0] = (m[k][j] - m[j][k]) * part;
    q[j + 1] = (m[j][i] + m[i][j]) * part;
    q[k + 1] = (m[k][i] + m[i][k]) * part;
}

} // namespace

void ellipsoidAxes(const double covariance[6], double rotation[4], double deviation[3])
{
    double a[3][3] = {{covariance[0], covariance[1], covariance[2]},
                      {covariance[1], covariance[3], covariance[4]},
                      {covariance[2], covariance[4], covariance[5]}};
    double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}; // columns
    constexpr int kSweeps = 12;                            // six do for any 3 x 3 matrix
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (size_t p = 0; p < 2; ++p)
            for (size_t q = p + 1; q < 3; ++q) {
                if (a[p][q] == 0)
                    continue;
                const double slope = (a[q][q] - a[p][p]) / (2 * a[p][q]);
                const double t = (slope < 0 ? -1 : 1) / (std::abs(slope) + std::sqrt(slope * slope + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                for (auto& r : a) { // columns p and q
                    const double x = r[p], y = r[q];
                    r[p] = c * x - s * y;
                    r[q] = s * x + c * y;
                }
                for (size_t i = 0; i < 3; ++i) { // rows
                    const double x = a[p][i], y = a[q][i];
                    a[p][i] = c * x - s * y;
                    a[q][i] = s * x + c * y;
                }
                for (auto& r : axes) {
                    const double x = r[p], y = r[q];
                    r[p] = c * x - s * y;
                    r[q] = s * x + c * y;
                }
            }
    for (size_t i = 0; i < 3; ++i)
        deviation[i] = std::sqrt(std::max(a[i][i], 0.0));
    quaternionOf(axes, rotation); // a product of rotations: no mirror
}

} // namespace gsc
