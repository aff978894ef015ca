#include "associate/rig_error.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::associate {
namespace {

// Median of the Rayleigh distribution: sqrt(2 ln 2) standard deviations of one axis.
constexpr double kRayleighMedian = 1.1774;
// Relative step of the running median: remembers about a hundred views. Chosen by hand; not yet measured.
constexpr double kMedianStep = 0.02;
// Errors have heavier tails than the normal distribution that belongs to the median. Chosen by hand; not yet measured.
constexpr double kSafetyFactor = 1.5;
// Lower bound, about the centroid noise of the best blobs (Cramer-Rao bound 0.0093 px).
constexpr double kMinSigma_px = 0.01;
// Lower bound of the gate. Chosen by hand; not yet measured.
constexpr double kMinWidenedSigma_px = 0.05;

}  // namespace

RigError::RigError(double max_px, std::size_t camera_count) : max_px_(max_px), sigma_px_(camera_count, max_px) {
  MOCAP_EXPECTS(camera_count >= 1 && max_px >= 0.0);
}

void RigError::learn(std::size_t camera, double error_px, double blob_px, std::size_t views) {
  MOCAP_EXPECTS(camera < sigma_px_.size() && views >= 3);
  // The point was fitted to the views, which shrinks the residuals: 3 of the 2 n degrees of freedom are used.
  const double freedom_correction = 1.0 - 1.5 / static_cast<double>(views);
  double& sigma_px = sigma_px_[camera];
  const double median_px2 =
      kRayleighMedian * kRayleighMedian * freedom_correction * (sigma_px * sigma_px + blob_px * blob_px);
  sigma_px *= error_px * error_px > median_px2 ? 1.0 + kMedianStep : 1.0 - kMedianStep;
  sigma_px = std::clamp(sigma_px, std::min(kMinSigma_px, max_px_), max_px_);
}

double RigError::px() const {
  return std::min(max_px_, kSafetyFactor * std::max(kMinWidenedSigma_px, *std::ranges::max_element(sigma_px_)));
}

void PointError::learn(double rms_px, double blob_px2, std::size_t views) {
  MOCAP_EXPECTS(views >= 3);
  const double n = static_cast<double>(views);
  const double freedom = 2.0 * n - 3.0;
  // The median of the chi-square distribution; approximation of Wilson and Hilferty (1931).
  const double median = freedom * std::pow(1.0 - 2.0 / (9.0 * freedom), 3);
  const bool more = n * rms_px * rms_px > median * (sigma_px_ * sigma_px_ + blob_px2);
  sigma_px_ = std::min(max_px_, std::max(kMinSigma_px, sigma_px_ * (more ? 1.0 + kMedianStep : 1.0 - kMedianStep)));
}

}  // namespace mocap::associate
