#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "associate/match_settings.h"
#include "associate/predicted/merged_blob_resolver.h"
#include "associate/rays/ray_bins.h"
#include "associate/rays/view_rays.h"

namespace mocap::associate {

/// A ray inside the gate of a predicted marker.
struct GateCandidate {
  std::uint32_t marker;
  std::uint32_t ray;
  float distance2;  ///< squared Mahalanobis distance
  float widening;   ///< determinant of the innovation covariance over that of the gate's floor
};

/// Bound for one view; candidates beyond the bound are ignored.
inline constexpr std::size_t kMaxGateCandidates = 16 * kMaxMarkers;

/// Projects the predicted markers into each view and finds the rays inside their gates. Never allocates after
/// construction.
class PredictionGates {
 public:
  /// `settings` must outlive this object.
  explicit PredictionGates(const MatchSettings& settings);

  /// Sets the predicted markers of a set.
  void set_predictions(const Predictions& predictions);

  /// Finds the rays of a view inside the gates, in the order of the markers. This result and those of the functions
  /// below are valid until the next call.
  std::span<const GateCandidate> candidates(const ViewRays& view);

  /// The number of gates that contain a ray of the view.
  std::uint16_t gates_containing(std::size_t ray) const { return gates_containing_[ray]; }
  /// The predicted measurements in the view.
  const PredictedMeasurements& predicted() const { return predicted_; }
  /// The index of the rays of the view.
  const RayBins& bins() const { return bins_; }

 private:
  void project_markers(const CameraModel& camera);
  void bound_gates(double focal_px);
  void gather_candidates(const ViewRays& view);
  void measure_candidates(const ViewRays& view, std::size_t count);

  const MatchSettings& settings_;
  std::size_t marker_count_ = 0;
  // Position and covariance (xx xy xz yy yz zz) of the predicted markers as columns; the position is NaN if not usable.
  std::array<std::vector<float>, 9> marker_columns_;
  PredictedMeasurements predicted_;
  struct NearbyRay {
    std::uint32_t marker, ray;
  };
  RayBins bins_;                   // of one view at a time, so that it stays in the cache
  std::vector<NearbyRay> nearby_;  // in the bins of the gates
  std::vector<GateCandidate> candidates_;
  std::size_t candidate_count_ = 0;
  std::vector<std::uint16_t> gates_containing_;
};

}  // namespace mocap::associate
