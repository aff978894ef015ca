#pragma once

#include <Eigen/LU>

#include "filter/point_filter.h"

namespace mocap::filter {

/// Determinant and adjugate of a symmetric matrix: the inverse is `adjugate / determinant`.
template <int N>
struct Cofactors {
  Matrix<N> adjugate;
  double determinant;

  explicit Cofactors(const Matrix<N>& m) {
    if constexpr (N == 3) {
      const double xx = m(0, 0), xy = m(1, 0), xz = m(2, 0), yy = m(1, 1), yz = m(2, 1), zz = m(2, 2);
      const double axx = yy * zz - yz * yz, axy = xz * yz - xy * zz, axz = xy * yz - xz * yy;
      const double ayy = xx * zz - xz * xz, ayz = xy * xz - xx * yz, azz = xx * yy - xy * xy;
      determinant = xx * axx + xy * axy + xz * axz;
      adjugate << axx, axy, axz, axy, ayy, ayz, axz, ayz, azz;
    } else {
      static_assert(N == 2);
      determinant = m(0, 0) * m(1, 1) - m(1, 0) * m(1, 0);
      adjugate << m(1, 1), -m(1, 0), -m(1, 0), m(0, 0);
    }
  }
};

/// The inverse of a symmetric matrix.
template <int N>
inline Matrix<N> inverse_of(const Matrix<N>& symmetric) {
  const Cofactors<N> cofactors(symmetric);
  return cofactors.adjugate * (1.0 / cofactors.determinant);
}

}  // namespace mocap::filter
