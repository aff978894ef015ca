#include "calibration/diagnosis/reprojection_evidence.h"

#include <cmath>
#include <numeric>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

// Ten standard deviations: wide enough to measure the density of other blobs beside that of views.
constexpr double kReach_px = 10.0 * kReprojectionSigma_px;
constexpr int kRounds = 20;  // of expectation maximisation; the share then changes by less than 1e-3
// The standard error of fewer values is not normal.
constexpr int kMinInstants = 8;

/// A blob near the projection of a point.
struct Sample {
  std::size_t instant = 0;
  double density_ratio = 0.0;  ///< of the view's Gaussian to the uniform density
};

double density_ratio(double distance_px) {
  const double z = distance_px / kReprojectionSigma_px;
  const double reach = kReach_px / kReprojectionSigma_px;
  return 0.5 * reach * reach * std::exp(-0.5 * z * z);
}

/// Samples of the points of one kind.
struct Stratum {
  std::vector<Sample> samples;

  // Share of the samples that are views, by expectation maximisation.
  double share() const {
    if (samples.empty()) return 0.0;
    double share = 0.5;
    for (int round = 0; round < kRounds; ++round) {
      double views = 0.0;
      for (const Sample& sample : samples)
        views += share * sample.density_ratio / (share * sample.density_ratio + 1.0 - share);
      share = std::min(views / static_cast<double>(samples.size()), 1.0 - 1e-6);
    }
    return share;
  }
};

}  // namespace

double ReprojectionEvidence::total() const { return std::accumulate(log_ratio.begin(), log_ratio.end(), 0.0); }

ReprojectionEvidence evidence_of(const CameraViews& camera, const std::vector<std::vector<ConsensusPoint>>& points) {
  std::array<Stratum, 2> strata;  // by is_confirmed
  ReprojectionEvidence evidence;
  evidence.log_ratio.assign(points.size(), 0.0);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const ConsensusPoint& point : points[i]) {
      const auto at = geometry::project(camera.model, point.point);
      if (!at || !geometry::in_image(camera.model, *at)) continue;
      evidence.expected += 1.0;
      evidence.confirmed += point.is_confirmed ? 1.0 : 0.0;
      for (const BlobView& blob : camera.instants[i]) {
        const double distance_px = (blob.at.v - at->v).norm();
        if (distance_px < kReach_px) strata[point.is_confirmed].samples.push_back({i, density_ratio(distance_px)});
      }
    }
  }
  for (const Stratum& stratum : strata) {
    const double share = stratum.share();
    for (const Sample& sample : stratum.samples)
      evidence.log_ratio[sample.instant] += std::log(share * sample.density_ratio + 1.0 - share);
    evidence.samples += stratum.samples.size();
  }
  evidence.seen = strata[1].share() * static_cast<double>(strata[1].samples.size());
  return evidence;
}

double vuong_statistic(const std::vector<double>& better, const std::vector<double>& worse, double parameters,
                       std::size_t samples) {
  double sum = 0.0;
  double squares = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < better.size(); ++i) {
    const double difference = better[i] - worse[i];
    if (difference == 0.0) continue;
    sum += difference;
    squares += difference * difference;
    ++count;
  }
  if (count < kMinInstants) return 0.0;
  const double mean = sum / count;
  const double variance = std::max(squares / count - mean * mean, 1e-12);
  const double correction = 0.5 * parameters * std::log(std::max<double>(1.0, static_cast<double>(samples)));
  return (sum - correction) / std::sqrt(count * variance);
}

}  // namespace mocap::calibration
