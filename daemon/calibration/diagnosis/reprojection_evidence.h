#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "calibration/diagnosis/camera_views.h"
#include "calibration/diagnosis/consensus_points.h"

namespace mocap::calibration {

/// Standard deviation of a blob about the projection of a point, each axis: the deviation of 1 px at which verify
/// reports a camera, and about 1 px of the point's own error in a rig that deviates so much.
inline constexpr double kReprojectionSigma_px = 1.5;

/// Chi-square gate of that deviation, 2 degrees of freedom, 99 %.
inline constexpr double kReprojectionGate_px = 3.03 * kReprojectionSigma_px;

/// The evidence that the blobs of a camera are views of the points of the other cameras.
struct ReprojectionEvidence {
  /// By instant: log likelihood ratio of "some of the blobs near the points are their views" to "none is".
  std::vector<double> log_ratio;
  double expected = 0.0;   ///< points that lie inside the image
  double confirmed = 0.0;  ///< those of them that three other cameras agree on
  double seen = 0.0;       ///< expected number of views of confirmed points, by the mixture
  std::size_t samples = 0;

  double total() const;
  /// Share of the confirmed points that the camera sees; 0 without any.
  double share() const { return confirmed > 0.0 ? seen / confirmed : 0.0; }
};

/// The blobs within kReach_px of the projection of a point are a mixture: views of the point, with Gaussian deviations
/// of kReprojectionSigma_px, and other blobs, uniformly distributed over the disc. The share of views is estimated by
/// maximum likelihood, apart for points of three cameras and of two.
ReprojectionEvidence evidence_of(const CameraViews& camera, const std::vector<std::vector<ConsensusPoint>>& points);

/// A standard normal statistic of the hypothesis that `better` explains the blobs no better than `worse`: the mean of
/// the differences of the log likelihoods over its standard error. `parameters`: number of parameters that were fitted
/// for `better` only (Schwarz's correction). 0 for fewer than kMinInstants instants with a difference.
///
/// Source: Vuong, "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57 (1989).
double vuong_statistic(const std::vector<double>& better, const std::vector<double>& worse, double parameters,
                       std::size_t samples);

/// Quantile of the standard normal distribution with a probability of 1e-6 beyond it: about 300 hypotheses of a rig of
/// 16 cameras are tested at a false alarm rate of 1 in 3000 rigs.
inline constexpr double kSignificant = 4.75;

}  // namespace mocap::calibration
