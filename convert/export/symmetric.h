// SPDX-License-Identifier: Apache-2.0
// Small dense systems: least squares by Cholesky's factors, axes of an ellipsoid by Jacobi's rotations.
#pragma once

#include <cstddef>

namespace gsc {

// Solves A x = b for `columns` right sides at once. A: symmetric, n x n, its lower triangle row by row without gaps,
// n (n + 1) / 2 values, which are replaced by its factor. b: n x columns, replaced by x. False if A is not positive
// definite; b is then of no use.
bool solveSymmetric(double* a, double* b, size_t n, size_t columns);

// Axes of the ellipsoid with the covariance xx, xy, xz, yy, yz, zz: a unit quaternion w x y z of the rotation that turns the
// coordinate axes into them, and the standard deviations along them, at least 0.
void ellipsoidAxes(const double covariance[6], double rotation[4], double deviation[3]);

} // namespace gsc
