#include "filter/point_filter.h"

#include <cmath>

#include "filter/symmetric.h"

namespace mocap::filter {
namespace {

constexpr double kLn2Pi = 1.8378770664093453;

}  // namespace

template <int N>
Vector<N> Gate<N>::reach(double sigmas, double max_variance) const {
  // Along an axis the ellipsoid d^T S^-1 d = k^2 reaches k sqrt(S_ii).
  return sigmas * (predicted_covariance.diagonal().array() + max_variance).sqrt().matrix();
}

template <int N>
typename Gate<N>::Fit Gate<N>::fit(const Seen<N>& seen) const {
  const Cofactors<N> innovation(predicted_covariance + seen.covariance);
  const Vector<N> off = seen.point - centre;
  const double distance2 = off.dot(innovation.adjugate * off) / innovation.determinant;
  return {distance2, distance2 + std::log(innovation.determinant) + N * kLn2Pi};
}

template <int N>
double Gate<N>::distance2(const Seen<N>& seen) const {
  const Cofactors<N> innovation(predicted_covariance + seen.covariance);
  const Vector<N> off = seen.point - centre;
  return off.dot(innovation.adjugate * off) / innovation.determinant;
}

template struct Gate<2>;
template struct Gate<3>;

}  // namespace mocap::filter
