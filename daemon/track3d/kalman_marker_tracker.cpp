#include "track3d/kalman_marker_tracker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "filter/kalman.h"
#include "filter/symmetric.h"
#include "model/bounds.h"
#include "track3d/point_tracks.h"

namespace mocap::track3d {
namespace {

// Density of measurements of unknown markers: one a cubic metre. Chosen by hand; not yet measured.
constexpr double kClutterDensity_1_m3 = 1.0;
// Gate of a marker that the matcher found at the prediction of its track, over the usual gate. Each view has its own
// gate in two dimensions, and two of them with their floor pass a marker 1.5 times as far away in 3D. A narrower gate
// would reject the marker at a jerk, and a second track would start in its place.
constexpr double kAssociationGateRatio = 1.5;

// Share of the sets in which a marker moves unlike the motion model (it is hit, or an image is missing unnoticed).
// Chosen by hand; not yet measured.
constexpr double kOutlierProbability = 0.01;
// Standard deviation of a bearing-only observation along its ray: practically no information.
constexpr double kDepthSigma_m = 1.0;
// A candidate without a measurement is kept for this long: two rays that just meet miss each other in some sets.
// Chosen by hand; not yet measured.
constexpr Duration kCandidateCoast = std::chrono::milliseconds(50);
// The ids of candidates: above those of the other tracks, which reach this number after 2e9 tracks.
constexpr std::uint32_t kFirstCandidateId = 0x8000'0000;

using Tracks = PointTracks<filter::Kalman<3>, 3>;

filter::KalmanSettings kalman_settings(const TrackMarkersSettings& settings) {
  filter::KalmanSettings kalman;
  kalman.acceleration_u_s2 = settings.acceleration_m_s2;
  kalman.acceleration_per_speed = settings.acceleration_per_speed_1_s;
  kalman.initial_speed_u_s = settings.initial_speed_m_s;
  kalman.gate_floor_u = settings.gate_floor_m;
  kalman.gate_per_speed = settings.gate_per_speed;
  kalman.max_noise_scale = settings.max_noise_scale;
  kalman.coast_half_life_s = to_s(settings.coast_half_life);
  kalman.white_noise = true;
  return kalman;
}

TrackLife life_of(const TrackMarkersSettings& settings) {
  TrackLife life;
  life.gate_sigmas = settings.gate_sigmas;
  life.confirm_sets = settings.confirm_sets;
  life.max_coast = settings.max_coast;
  life.clutter_density = kClutterDensity_1_m3;
  life.association_sigmas = kAssociationGateRatio * settings.gate_sigmas;
  life.outlier_probability = kOutlierProbability;
  life.max_coast_sigma_u = settings.max_coast_sigma_m;
  return life;
}

TrackLife candidate_life_of(const TrackMarkersSettings& settings) {
  TrackLife life = life_of(settings);
  life.max_coast = std::min(life.max_coast, kCandidateCoast);
  life.outlier_probability = 0.0;
  return life;
}

class KalmanMarkerTracker final : public MarkerTracker {
 public:
  explicit KalmanMarkerTracker(const TrackMarkersSettings& settings)
      : kalman_(kalman_settings(settings)),
        sighting_floor_m2_(settings.sighting_floor_m * settings.sighting_floor_m),
        gate2_(settings.gate_sigmas * settings.gate_sigmas),
        tracks_(life_of(settings), kMaxMarkers, kMaxMarkers),
        candidates_(candidate_life_of(settings), kMaxMarkers, kMaxMarkers, kFirstCandidateId) {
    measurements_.reserve(kMaxMarkers);
    usable_.resize(kMaxMarkers);
  }

  const PredictedMarkers& predict(Timestamp at) override {
    predictions_.clear();
    const double dt_s = std::max(0.0, to_s(at - tracks_.at()));
    for (std::size_t i = 0; i < tracks_.tracks().size(); ++i) {
      const Tracks::Track& track = tracks_.tracks()[i];
      const filter::Gate<3> gate = track.filter.gate_in(dt_s);
      if (tracks_.has_ended(track, gate, at)) continue;
      PredictedMarker& predicted = predictions_.push_back(none_);
      predicted.position = {gate.centre};
      predicted.covariance_m2 = gate.predicted_covariance;
      predicted.track = {track.id};
      predicted.cameras = tracked_[i].cameras;  // tracks_ and tracked_ are in the same order
    }
    return predictions_;
  }

  const TrackedMarkers& step(const Markers& markers, const Predictions& predicted,
                             std::span<const BearingOnlyObservation> bearing_only,
                             std::span<const CandidatePoint> candidates) override {
    measurements_.clear();
    for (const Marker& marker : markers) add_measurement(marker.position, marker.covariance_m2);
    tracks_.advance(predicted.at, measurements_.size());
    for (std::uint32_t i = 0; i < measurements_.size(); ++i) {
      if (usable_[i] == 0) {
        tracks_.ignore(i);
      } else if (const PredictedMarker* prediction = prediction_of(markers[i], predicted)) {
        // If no track has ended since, the index of the prediction is the index of the track.
        Tracks::Track* track = prediction->track.names_something()
                                   ? tracks_.find(prediction->track.value, markers[i].prediction)
                                   : nullptr;
        if (track != nullptr) tracks_.associate(*track, measurements_, i, markers[i].by_blob_tracks);
      }
    }
    tracks_.assign(measurements_);
    for (Tracks::Track& track : tracks_.tracks()) track.measurable = is_measurable(track, predicted.cameras);
    tracks_.update(measurements_, [this](const filter::Seen<3>& seen) { return filter::Kalman<3>(kalman_, seen); });
    for (const BearingOnlyObservation& ray : bearing_only) update_by_bearing(ray, predicted);
    report_tracks(markers, predicted);
    track_candidates(candidates, predicted.at);
    report_candidates();
    return tracked_;
  }

  // A track keeps the motion model that it was initiated with.
  void adopt(MarkerTracker& before, const Handover& handover) override {
    auto* same = dynamic_cast<KalmanMarkerTracker*>(&before);
    if (same == nullptr) return;
    if (!handover.poses) {
      tracks_.continue_ids(same->tracks_);
      candidates_.continue_ids(same->candidates_);
      return;
    }
    tracks_.adopt(same->tracks_);
    for (Tracks::Track& track : tracks_.tracks()) {
      track.seen_by = handover.now(track.seen_by);
      if (std::popcount(track.seen_by) < 2) track.seen_by = 0;  // unknown: two cameras are needed to measure the marker
    }
    candidates_.adopt(same->candidates_);
    tracked_ = same->tracked_;
  }

  void archive(Archive& members) override {
    const filter::Kalman<3> filter(kalman_, filter::Seen<3>{filter::Vector<3>::Zero(), filter::Matrix<3>::Identity()});
    tracks_.archive(members, filter);
    candidates_.archive(members, filter);
    members(tracked_);
    // The first elements of tracked_ are those of tracks_.
    if (tracked_.size() < tracks_.tracks().size()) members.fail();
  }

 private:
  // Whether at least two of the cameras that saw the marker last have an image in the set. The probability of detection
  // is 0 in any other set, so the absence of a measurement says nothing (decision 0002).
  static bool is_measurable(const Tracks::Track& track, CameraBits cameras) {
    return cameras == 0 || track.seen_by == 0 || std::popcount(track.seen_by & cameras) >= 2;
  }

  // Appends the measurement of a point and whether it is usable.
  void add_measurement(const WorldPoint& position, const Eigen::Matrix3d& covariance_m2) {
    measurements_.push_back({position.v, covariance_m2});
    filter::Cofactors<3> cofactors(covariance_m2);
    // Determinant over the sum of the principal minors: a lower bound of the smallest eigenvalue, tight if that one is
    // small against the others.
    const double minors = cofactors.adjugate.trace();
    const double least = minors > 0.0 ? cofactors.determinant / minors : 0.0;
    // The smallest eigenvalue is raised to the floor.
    if (sighting_floor_m2_ > least) {
      measurements_.back().covariance.diagonal().array() += sighting_floor_m2_ - least;
      cofactors = filter::Cofactors<3>(measurements_.back().covariance);
    }
    usable_[measurements_.size() - 1] = is_usable(measurements_.back(), cofactors) ? 1 : 0;
  }

  // Whether the point is finite and the covariance positive definite (Sylvester's criterion). A value that is not
  // finite makes the determinant not finite.
  static bool is_usable(const filter::Seen<3>& seen, const filter::Cofactors<3>& cofactors) {
    return seen.point.allFinite() && std::isfinite(cofactors.determinant) && cofactors.determinant > 0.0 &&
           cofactors.adjugate(2, 2) > 0.0 && seen.covariance(0, 0) > 0.0;
  }

  static const PredictedMarker* prediction_of(const Marker& marker, const Predictions& predicted) {
    return marker.prediction < predicted.markers.size() ? &predicted.markers[marker.prediction] : nullptr;
  }

  // Updates a track across a bearing; its uncertainty along the ray stays about the same.
  void update_by_bearing(const BearingOnlyObservation& bearing_only, const Predictions& predicted) {
    const PredictedMarker& prediction = predicted.markers[bearing_only.prediction];
    Tracks::Track* track = prediction.track.names_something() ? tracks_.find(prediction.track.value) : nullptr;
    if (track == nullptr || track->measurement != Tracks::kNone || !track->confirmed) return;
    const double depth_m = (track->gate.centre - bearing_only.eye.v).dot(bearing_only.direction);
    if (!(depth_m > 0.0)) return;
    const filter::Matrix<3> along = bearing_only.direction * bearing_only.direction.transpose();
    const double across_m = std::hypot(bearing_only.sigma_rad * depth_m, std::sqrt(sighting_floor_m2_));
    const filter::Matrix<3> across = filter::Matrix<3>::Identity() - along;
    const filter::Seen<3> seen{bearing_only.eye.v + depth_m * bearing_only.direction,
                               across * (across_m * across_m) + along * (kDepthSigma_m * kDepthSigma_m)};
    if (!(track->gate.fit(seen).distance2 <= gate2_)) return;
    track->filter.update(seen);
    track->seen_at = predicted.at;
  }

  void report_tracks(const Markers& markers, const Predictions& predicted) {
    tracked_.clear();
    for (Tracks::Track& track : tracks_.tracks()) {
      const bool seen = track.measurement != Tracks::kNone;
      const PredictedMarker* prediction = seen ? prediction_of(markers[track.measurement], predicted) : nullptr;
      const bool predicted_by_body =
          prediction != nullptr && !prediction->track.names_something() && prediction->label.names_something();
      if (predicted_by_body && track.age_sets == 1) track.confirmed = true;

      const filter::Belief<3> belief = track.filter.belief();
      TrackedMarker& out = tracked_.push_back(unseen_);
      out.id = {track.id};
      out.state = !track.confirmed ? TrackState::Tentative : seen ? TrackState::Confirmed : TrackState::Coasting;
      out.position = {belief.point};
      out.velocity_m_s = belief.velocity;
      out.covariance_m2 = belief.covariance;
      out.age_sets = track.age_sets;
      out.missed_sets = track.missed_sets;
      if (!seen) continue;
      out.residual_px = markers[track.measurement].residual_px;
      out.cameras = markers[track.measurement].cameras;
      out.seen_by = track.seen_by = markers[track.measurement].seen_by;
      // A measurement that was matched to the prediction of another track, which rejected it, has no prediction.
      if (prediction != nullptr && (predicted_by_body || prediction->track.value == track.id))
        out.prediction = markers[track.measurement].prediction;
    }
  }

  // Candidates are tracked by position only. They share blobs, so that the matcher cannot assign blobs to them.
  void track_candidates(std::span<const CandidatePoint> candidates, Timestamp at) {
    if (candidates.empty() && candidates_.tracks().empty()) return;
    measurements_.clear();
    for (const CandidatePoint& candidate : candidates) add_measurement(candidate.position, candidate.covariance_m2);
    candidates_.advance(at, measurements_.size());
    for (std::uint32_t i = 0; i < measurements_.size(); ++i) {
      if (usable_[i] == 0) candidates_.ignore(i);
    }
    candidates_.assign(measurements_);
    candidates_.update(measurements_, [this](const filter::Seen<3>& seen) { return filter::Kalman<3>(kalman_, seen); });
  }

  void report_candidates() {
    for (const Tracks::Track& track : candidates_.tracks()) {
      if (tracked_.full()) return;
      if (!track.confirmed) continue;
      const filter::Belief<3> belief = track.filter.belief();
      TrackedMarker& out = tracked_.push_back(unseen_);
      out.id = {track.id};
      out.state = track.measurement != Tracks::kNone ? TrackState::Candidate : TrackState::Coasting;
      out.position = {belief.point};
      out.velocity_m_s = belief.velocity;
      out.covariance_m2 = belief.covariance;
      out.cameras = track.measurement != Tracks::kNone ? 2 : 0;
      out.age_sets = track.age_sets;
      out.missed_sets = track.missed_sets;
    }
  }

  filter::KalmanSettings kalman_;
  double sighting_floor_m2_;
  double gate2_;
  Tracks tracks_;
  Tracks candidates_;
  std::vector<filter::Seen<3>> measurements_;
  std::vector<std::uint8_t> usable_;  // by measurement
  TrackedMarkers tracked_;
  PredictedMarkers predictions_;
  // Copying an empty element is cheaper than value-initialising one.
  const PredictedMarker none_{};
  const TrackedMarker unseen_{};
};

}  // namespace

std::unique_ptr<MarkerTracker> make_marker_tracker(const TrackMarkersSettings& settings) {
  return std::make_unique<KalmanMarkerTracker>(settings);
}

}  // namespace mocap::track3d
