#include "track3d/kalman_marker_tracker.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "filter/kalman.h"
#include "filter/symmetric.h"
#include "model/bounds.h"
#include "track3d/point_tracks.h"

namespace mocap::track3d {
namespace {

// Sightings of unknown markers to reckon with: one a cubic metre.
constexpr double kClutterDensity_1_m3 = 1.0;
// A marker that the views found where its track should be is that track: they weighed it against all others. Each view
// has a gate of its own on two axes; two of them and their pixels' floor let pass what lies half as far again in 3D. A
// narrower gate here would refuse the marker at a jerk, and a second track would be born in its place.
constexpr double kAssociationGateRatio = 1.5;

// One set in a hundred a marker does what nobody could foresee.
constexpr double kOutlierProbability = 0.01;
// A ray tells nothing of how far away the marker is.
constexpr double kDepthSigma_m = 1.0;

using Tracks = PointTracks<filter::Kalman<3>, 3>;

filter::KalmanSettings kalman_settings(const TrackMarkersSettings& settings) {
  filter::KalmanSettings kalman;
  kalman.acceleration_u_s2 = settings.acceleration_m_s2;
  kalman.acceleration_per_speed = settings.acceleration_per_speed_1_s;
  kalman.birth_speed_u_s = settings.birth_speed_m_s;
  kalman.gate_floor_u = settings.gate_floor_m;
  kalman.gate_per_speed = settings.gate_per_speed;
  kalman.max_agility = settings.max_agility;
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

class KalmanMarkerTracker final : public MarkerTracker {
 public:
  explicit KalmanMarkerTracker(const TrackMarkersSettings& settings)
      : kalman_(kalman_settings(settings)),
        sighting_floor_m2_(settings.sighting_floor_m * settings.sighting_floor_m),
        gate2_(settings.gate_sigmas * settings.gate_sigmas),
        tracks_(life_of(settings), kMaxMarkers, kMaxMarkers) {
    measurements_.reserve(kMaxMarkers);
    usable_.resize(kMaxMarkers);
  }

  void predict(Timestamp at, Expected& into) const override {
    const double dt_s = std::max(0.0, to_s(at - tracks_.at()));
    for (std::size_t i = 0; i < tracks_.tracks().size(); ++i) {
      const Tracks::Track& track = tracks_.tracks()[i];
      const filter::Gate<3> gate = track.filter.gate_in(dt_s);
      if (tracks_.has_ended(track, gate, at)) continue;
      if (into.markers.full()) return;
      ExpectedMarker& expected = into.markers.push_back(none_);
      expected.position = {gate.centre};
      expected.covariance_m2 = gate.covariance;
      expected.track = {track.id};
      expected.cameras = tracked_[i].cameras;  // told in the same order
    }
  }

  const TrackedMarkers& step(const Markers& markers, const Expected& expected,
                             std::span<const BearingOnlyObservation> bearing_only) override {
    measurements_.clear();
    for (const Marker& marker : markers) add_measurement(marker);
    tracks_.advance(expected.at, measurements_.size());
    for (std::uint32_t i = 0; i < measurements_.size(); ++i) {
      if (usable_[i] == 0) {
        tracks_.ignore(i);
      } else if (const ExpectedMarker* prediction = prediction_of(markers[i], expected)) {
        // Where no track ended, they are expected in the order in which they are.
        Tracks::Track* track =
            prediction->track.names_something() ? tracks_.find(prediction->track.value, markers[i].expected) : nullptr;
        if (track != nullptr) tracks_.associate(*track, measurements_, i, markers[i].by_blob_tracks);
      }
    }
    tracks_.assign(measurements_);
    tracks_.update(measurements_, [this](const filter::Seen<3>& seen) { return filter::Kalman<3>(kalman_, seen); });
    for (const BearingOnlyObservation& ray : bearing_only) update_by_bearing(ray, expected);
    report_tracks(markers, expected);
    return tracked_;
  }

 private:
  // Appends where a marker was seen, and whether that can be used.
  void add_measurement(const Marker& marker) {
    measurements_.push_back({marker.position.v, marker.covariance_m2});
    filter::Cofactors<3> cofactors(marker.covariance_m2);
    // A bound from below of the least eigenvalue, tight where that one is small against the others: determinant over
    // the sum of the principal 2x2 minors.
    const double minors = cofactors.adjugate.trace();
    const double least = minors > 0.0 ? cofactors.determinant / minors : 0.0;
    // No direction is more certain than the floor; where all are less, the covariance is believed as it is.
    if (sighting_floor_m2_ > least) {
      measurements_.back().covariance.diagonal().array() += sighting_floor_m2_ - least;
      cofactors = filter::Cofactors<3>(measurements_.back().covariance);
    }
    usable_[measurements_.size() - 1] = is_usable(measurements_.back(), cofactors) ? 1 : 0;
  }

  /// Finite, with a covariance that is one (Sylvester's criterion); what is not finite makes the determinant so too.
  static bool is_usable(const filter::Seen<3>& seen, const filter::Cofactors<3>& cofactors) {
    return seen.point.allFinite() && std::isfinite(cofactors.determinant) && cofactors.determinant > 0.0 &&
           cofactors.adjugate(2, 2) > 0.0 && seen.covariance(0, 0) > 0.0;
  }

  static const ExpectedMarker* prediction_of(const Marker& marker, const Expected& expected) {
    return marker.expected < expected.markers.size() ? &expected.markers[marker.expected] : nullptr;
  }

  // A marker that one camera sees is known across the ray as well as ever, and along it no better than before.
  void update_by_bearing(const BearingOnlyObservation& bearing_only, const Expected& expected) {
    const ExpectedMarker& prediction = expected.markers[bearing_only.expected];
    Tracks::Track* track = prediction.track.names_something() ? tracks_.find(prediction.track.value) : nullptr;
    if (track == nullptr || track->sighting != Tracks::kNone || !track->confirmed) return;
    const double depth_m = (track->gate.centre - bearing_only.eye.v).dot(bearing_only.direction);
    if (!(depth_m > 0.0)) return;
    const filter::Matrix<3> along = bearing_only.direction * bearing_only.direction.transpose();
    const double across_m = std::hypot(bearing_only.sigma_rad * depth_m, std::sqrt(sighting_floor_m2_));
    const filter::Matrix<3> across = filter::Matrix<3>::Identity() - along;
    const filter::Seen<3> seen{bearing_only.eye.v + depth_m * bearing_only.direction,
                               across * (across_m * across_m) + along * (kDepthSigma_m * kDepthSigma_m)};
    if (!(track->gate.fit(seen).distance2 <= gate2_)) return;
    track->filter.update(seen);
    track->seen_at = expected.at;
  }

  void report_tracks(const Markers& markers, const Expected& expected) {
    tracked_.clear();
    for (Tracks::Track& track : tracks_.tracks()) {
      const bool seen = track.sighting != Tracks::kNone;
      const ExpectedMarker* prediction = seen ? prediction_of(markers[track.sighting], expected) : nullptr;
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
      out.residual_px = markers[track.sighting].residual_px;
      out.cameras = markers[track.sighting].cameras;
      // A sighting that was expected to be another track, and was refused there, brings no name with it.
      if (prediction != nullptr && (predicted_by_body || prediction->track.value == track.id))
        out.expected_label = prediction->label;
    }
  }

  filter::KalmanSettings kalman_;
  double sighting_floor_m2_;
  double gate2_;
  Tracks tracks_;
  std::vector<filter::Seen<3>> measurements_;
  std::vector<std::uint8_t> usable_;  // by what was seen
  TrackedMarkers tracked_;
  // A copy is made in one go; one made from nothing is cleared first.
  const ExpectedMarker none_{};
  const TrackedMarker unseen_{};
};

}  // namespace

std::unique_ptr<MarkerTracker> make_marker_tracker(const TrackMarkersSettings& settings) {
  return std::make_unique<KalmanMarkerTracker>(settings);
}

}  // namespace mocap::track3d
