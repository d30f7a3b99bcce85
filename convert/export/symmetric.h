// SPDX-License-Identifier: Apache-2.0
// Solves small symmetric systems: least squares by Cholesky's method, axes of an ellipsoid by Jacobi's.
#pragma once

#include <cstddef>

namespace gsc {

// Solves A x = b for `columns` right sides at once. `a`: lower triangle of the symmetric n x n matrix A, row by row, n
// (n + 1) / 2 values; it is overwritten. `b`: n x `columns` values, replaced by x. Returns false if A is not positive
// definite; `b` is then invalid.
bool solveSymmetric(double* a, double* b, size_t n, size_t columns);

// Axes of the ellipsoid with the covariance xx, xy, xz, yy, yz, zz. `rotation`: unit quaternion w x y z that turns the
// coordinate axes into them. `deviation`: standard deviation along each, 0 or more.
void ellipsoidAxes(const double covariance[6], double rotation[4], double deviation[3]);

} // namespace gsc
