#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "label/labelled_tracks.h"
#include "model/predictions.h"
#include "model/sighting.h"

namespace mocap::test {

/// A track that is detected in this set.
inline TrackedMarker detected_track(std::uint32_t id, const Eigen::Vector3d& position) {
  TrackedMarker track;
  track.id = TrackId{id};
  track.state = TrackState::Confirmed;
  track.position.v = position;
  track.covariance_m2 = 1e-6 * Eigen::Matrix3d::Identity();
  track.cameras = 4;
  track.age_sets = 10;
  return track;
}

/// Gives the tracks of a set to `tracks`. No track is associated with a prediction.
inline void update(label::LabelledTracks& tracks, const TrackedMarkers& tracked) {
  static const Predictions no_predictions;
  tracks.update(tracked, no_predictions);
}

}  // namespace mocap::test
