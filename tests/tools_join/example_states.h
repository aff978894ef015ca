#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "mocap/v1/snapshot.pb.h"

namespace mocap::join {

// Adds a marker that cameras measured.
inline void add_marker(v1::LabelledMarkers& markers, const Eigen::Vector3d& at_m, std::uint32_t track_plus_one = 0) {
  markers.add_states(v1::MARKER_STATE_MEASURED);
  for (const double number : at_m) markers.add_positions_m(static_cast<float>(number));
  markers.add_track_ids_plus_one(track_plus_one);
}

// A tracked subject with markers in a row and one bone.
inline v1::SubjectState tracked_subject(int markers, double joint_x_m = 0.0) {
  v1::SubjectState subject;
  subject.set_phase(v1::SUBJECT_PHASE_TRACKING);
  for (int m = 0; m < markers; ++m) add_marker(*subject.mutable_markers(), {0.1 * m, 0.0, 1.0});
  subject.mutable_bones()->add_states(v1::BONE_STATE_MEASURED);
  for (const double number : {joint_x_m, 0.0, 1.0}) {
    subject.mutable_bones()->add_world_positions_m(static_cast<float>(number));
  }
  return subject;
}

inline v1::Snapshot snapshot_with(const std::vector<v1::SubjectState>& subjects) {
  v1::Snapshot snapshot;
  for (const v1::SubjectState& subject : subjects) *snapshot.add_subjects() = subject;
  return snapshot;
}

}  // namespace mocap::join
