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

/// A ray in the gate of an expected marker.
struct GateCandidate {
  std::uint32_t marker;
  std::uint32_t ray;
  float distance2;  ///< in standard deviations, squared
  float widening;   ///< how much larger the gate's area is than its floor's
};

/// More of them in one view: the gates tell nothing any more, and the rest is left out.
inline constexpr std::size_t kMaxGateCandidates = 16 * kMaxMarkers;

/// Where each view should see the expected markers, and which rays lie there. Never allocates after construction.
class PredictionGates {
 public:
  /// `settings` must outlive it.
  explicit PredictionGates(const MatchSettings& settings);

  /// Takes in the markers of a set.
  void set_predictions(const Expected& expected);

  /// The rays of a view in each marker's gate, by marker. Valid until the next call, as is what follows.
  std::span<const GateCandidate> candidates(const ViewRays& view);

  /// In how many gates of that view a ray lies.
  std::uint16_t gates_containing(std::size_t ray) const { return gates_containing_[ray]; }
  const PredictedMeasurements& predicted() const { return predicted_; }
  /// Of the view's rays.
  const RayBins& bins() const { return bins_; }

 private:
  void project_markers(const CameraModel& camera);
  void bound_gates(double focal_px);
  void gather_candidates(const ViewRays& view);
  void measure_candidates(const ViewRays& view, std::size_t count);

  const MatchSettings& settings_;
  std::size_t marker_count_ = 0;
  // Place and covariance (xx xy xz yy yz zz) of each expected marker, by column; the place is NaN where not usable.
  std::array<std::vector<float>, 9> expected_;
  PredictedMeasurements predicted_;
  struct NearbyRay {
    std::uint32_t marker, ray;
  };
  RayBins bins_;                   // of the view: one for all of them stays in the cache
  std::vector<NearbyRay> nearby_;  // by bins
  std::vector<GateCandidate> candidates_;
  std::size_t candidate_count_ = 0;
  std::vector<std::uint16_t> gates_containing_;
};

}  // namespace mocap::associate
