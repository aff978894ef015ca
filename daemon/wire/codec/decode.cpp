#include "wire/codec/decode.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "wire/codec/encode_numbers.h"

namespace mocap::wire {
namespace {

// Rounding to single precision changes the norm by about 1e-7. A larger deviation means that the sender did not
// normalise.
constexpr float kUnitNorm = 1e-3F;

Error wrong_snapshot(std::string message) { return {ErrorCode::InvalidArgument, "snapshot: " + std::move(message)}; }

SubjectPhase subject_phase_of(v1::SubjectPhase code) {
  switch (code) {
    case v1::SUBJECT_PHASE_TRACKING: return SubjectPhase::Tracking;
    case v1::SUBJECT_PHASE_LOST: return SubjectPhase::Lost;
    default: return SubjectPhase::Searching;
  }
}

LabelState marker_state_of(int code) {
  switch (code) {
    case v1::MARKER_STATE_MEASURED: return LabelState::Measured;
    case v1::MARKER_STATE_FILLED: return LabelState::Filled;
    default: return LabelState::Lost;
  }
}

BoneState bone_state_of(int code) {
  switch (code) {
    case v1::BONE_STATE_MEASURED: return BoneState::Measured;
    case v1::BONE_STATE_FILLED: return BoneState::Filled;
    default: return BoneState::Lost;
  }
}

TrackId track_of(std::uint32_t plus_one) { return plus_one == 0 ? TrackId{} : TrackId{plus_one - 1}; }

template <class Column>
Status has(const Column& column, int count, int width, const char* name) {
  if (column.size() == count * width) return {};
  return wrong_snapshot(
      fmt::format("{} has {} numbers, expected {} for {} entries", name, column.size(), count * width, count));
}

using Floats = google::protobuf::RepeatedField<float>;

Status finite(const Floats& column, const char* name) {
  for (int i = 0; i < column.size(); ++i) {
    if (!std::isfinite(column[i]))
      return wrong_snapshot(fmt::format("{}[{}] is {}, expected a number", name, i, column[i]));
  }
  return {};
}

// Checks an optional column: empty, or `width` numbers for each of `count` entries.
template <class Column>
Status has_perhaps(const Column& column, int count, int width, const char* name) {
  return column.empty() ? Status{} : has(column, count, width, name);
}

double residual_at(const google::protobuf::RepeatedField<std::uint32_t>& millipx, int i) {
  return millipx.empty() ? 0.0 : 1e-3 * millipx[i];
}

Status within(int count, std::size_t bound, const char* name) {
  if (static_cast<std::size_t>(count) <= bound) return {};
  return wrong_snapshot(fmt::format("{} has {} entries, at most {} are allowed", name, count, bound));
}

Status percents(const google::protobuf::RepeatedField<std::uint32_t>& column, const char* name) {
  for (const std::uint32_t p : column) {
    if (p > 100) return wrong_snapshot(fmt::format("{} holds {}, expected 0 to 100", name, p));
  }
  return {};
}

// Returns the first failure of several checks.
template <class... Statuses>
Status all(Statuses... checks) {
  Status first;
  const auto take = [&](const Status& check) {
    if (first && !check) first = check;
  };
  (take(checks), ...);
  return first;
}

Eigen::Vector3d vector_at(const Floats& column, int i) { return {column[3 * i], column[3 * i + 1], column[3 * i + 2]}; }

Eigen::Quaterniond rotation_at(const Floats& column, int i) {
  return {column[4 * i + 3], column[4 * i], column[4 * i + 1],
          column[4 * i + 2]};  // Eigen's constructor has the order w x y z
}

Result<Instants> decode_instants(const v1::Snapshot& from) {
  if (!from.has_instants()) return wrong_snapshot("instants are missing, expected at least exposed_at_ns");
  const v1::Instants& wire = from.instants();
  Instants into;
  into.exposed_at = from_ns(wire.exposed_at_ns());
  if (wire.has_received_at_ns()) into.received_at = from_ns(wire.received_at_ns());
  if (wire.has_detected_at_ns()) into.detected_at = from_ns(wire.detected_at_ns());
  if (wire.has_fused_at_ns()) into.fused_at = from_ns(wire.fused_at_ns());
  if (wire.has_sent_at_ns()) into.sent_at = from_ns(wire.sent_at_ns());
  return into;
}

Status decode_views(const v1::Views& from, BoundedVector<ViewStatus, kMaxCameras>& into) {
  const int count = from.cameras_size();
  if (const Status fits = all(within(count, kMaxCameras, "views"), has(from.frame_numbers(), count, 1, "frame_numbers"),
                              has(from.skews_ns(), count, 1, "skews_ns"), has(from.blobs(), count, 1, "blobs"));
      !fits) {
    return fits;
  }
  for (int i = 0; i < count; ++i) {
    const CameraId camera{from.cameras(i)};
    if (camera.value >= kMaxCameras)
      return wrong_snapshot(fmt::format("views name camera {}, expected 0 to {}", camera.value, kMaxCameras - 1));
    if (std::any_of(into.begin(), into.end(), [&](const auto& v) { return v.camera == camera; })) {
      return wrong_snapshot(fmt::format("views name camera {} twice", camera.value));
    }
    into.push_back({camera, from.frame_numbers(i), Duration(from.skews_ns(i)), from.blobs(i)});
  }
  return {};
}

Status decode_markers(const v1::LabelledMarkers& from, BoundedVector<LabelledMarker, kMaxLabels>& into) {
  const int count = from.states_size();
  if (const Status fits = all(
          within(count, kMaxLabels, "markers"), has(from.positions_m(), count, 3, "positions_m"),
          has_perhaps(from.residuals_millipx(), count, 1, "residuals_millipx"),
          has(from.cameras(), count, 1, "cameras"), has(from.confidences_percent(), count, 1, "confidences_percent"),
          has(from.track_ids_plus_one(), count, 1, "track_ids_plus_one"), finite(from.positions_m(), "positions_m"),
          percents(from.confidences_percent(), "confidences_percent"));
      !fits) {
    return fits;
  }
  for (int i = 0; i < count; ++i) {
    LabelledMarker& marker = into.push_back({});
    marker.state = marker_state_of(from.states(i));
    marker.position.v = vector_at(from.positions_m(), i);
    marker.residual_px = residual_at(from.residuals_millipx(), i);
    marker.cameras = from.cameras(i);
    marker.confidence = static_cast<float>(from.confidences_percent(i)) / 100.0F;
    marker.track = track_of(from.track_ids_plus_one(i));
  }
  return {};
}

Status unit(const Floats& column, const char* name) {
  for (int i = 0; 4 * i < column.size(); ++i) {
    const double norm = rotation_at(column, i).norm();
    if (!(std::abs(norm - 1.0) < kUnitNorm)) {  // NaN is rejected, too
      return wrong_snapshot(
          fmt::format("{}: rotation {} has length {:.6g}, expected a unit quaternion", name, i, norm));
    }
  }
  return {};
}

Status check_bones(const v1::BonePoses& from) {
  const int count = from.states_size();
  const Status fits =
      all(within(count, kMaxBones, "bones"), has(from.world_positions_m(), count, 3, "world_positions_m"),
          has(from.world_rotations_xyzw(), count, 4, "world_rotations_xyzw"),
          has(from.local_rotations_xyzw(), count, 4, "local_rotations_xyzw"),
          has(from.confidences_percent(), count, 1, "confidences_percent"));
  if (!fits) return fits;
  return all(has_perhaps(from.local_positions_m(), count, 3, "local_positions_m"),
             has_perhaps(from.velocities_m_s(), count, 3, "velocities_m_s"),
             has_perhaps(from.spins_rad_s(), count, 3, "spins_rad_s"),
             finite(from.local_positions_m(), "local_positions_m"), finite(from.velocities_m_s(), "velocities_m_s"),
             finite(from.spins_rad_s(), "spins_rad_s"), finite(from.world_positions_m(), "world_positions_m"),
             unit(from.world_rotations_xyzw(), "world_rotations_xyzw"),
             unit(from.local_rotations_xyzw(), "local_rotations_xyzw"),
             percents(from.confidences_percent(), "confidences_percent"));
}

Status decode_bones(const v1::BonePoses& from, BoundedVector<BonePose, kMaxBones>& into) {
  if (const Status fits = check_bones(from); !fits) return fits;
  for (int i = 0; i < from.states_size(); ++i) {
    BonePose& bone = into.push_back({});
    bone.state = bone_state_of(from.states(i));
    bone.world_from_bone = {vector_at(from.world_positions_m(), i), rotation_at(from.world_rotations_xyzw(), i)};
    bone.parent_from_bone.rotation = rotation_at(from.local_rotations_xyzw(), i);
    if (!from.local_positions_m().empty()) bone.parent_from_bone.position = vector_at(from.local_positions_m(), i);
    bone.confidence = static_cast<float>(from.confidences_percent(i)) / 100.0F;
    if (!from.velocities_m_s().empty()) bone.velocity_m_s = vector_at(from.velocities_m_s(), i);
    if (!from.spins_rad_s().empty()) bone.spin_rad_s = vector_at(from.spins_rad_s(), i);
  }
  return {};
}

template <class Subjects>
bool names(const Subjects& subjects, SubjectId subject) {
  return std::any_of(subjects.begin(), subjects.end(), [&](const auto& s) { return s.subject == subject; });
}

Status decode_subject_state(const v1::SubjectState& from, Snapshot& into) {
  const SubjectId subject{from.subject()};
  if (subject.value >= kMaxSubjects) {
    return wrong_snapshot(fmt::format("subject is {}, expected 0 to {}", subject.value, kMaxSubjects - 1));
  }
  if (names(into.labels, subject) || names(into.poses, subject)) {
    return wrong_snapshot(fmt::format("subject {} occurs twice", subject.value));
  }
  if (from.has_markers()) {
    SubjectLabels& labels = into.labels.push_back({});
    labels.subject = subject;
    labels.phase = subject_phase_of(from.phase());
    if (const Status read = decode_markers(from.markers(), labels.markers); !read) return read;
  }
  if (from.has_bones()) {
    SubjectPose& pose = into.poses.push_back({});
    pose.subject = subject;
    if (!std::isfinite(from.residual_m())) return wrong_snapshot("residual_m is not a number");
    pose.residual_m = from.residual_m();
    if (!std::isfinite(from.smoothing_delay_s())) return wrong_snapshot("smoothing_delay_s is not a number");
    pose.smoothing_delay_s = from.smoothing_delay_s();
    if (const Status read = decode_bones(from.bones(), pose.bones); !read) return read;
  }
  return {};
}

Status decode_unlabelled(const v1::UnlabelledMarkers& from, BoundedVector<UnlabelledMarker, kMaxMarkers>& into) {
  const int count = from.track_ids_plus_one_size();
  if (const Status fits =
          all(within(count, kMaxMarkers, "unlabelled"), has(from.positions_m(), count, 3, "positions_m"),
              has_perhaps(from.residuals_millipx(), count, 1, "residuals_millipx"),
              has(from.cameras(), count, 1, "cameras"), finite(from.positions_m(), "positions_m"));
      !fits) {
    return fits;
  }
  for (int i = 0; i < count; ++i) {
    into.push_back({track_of(from.track_ids_plus_one(i)), WorldPoint{vector_at(from.positions_m(), i)},
                    residual_at(from.residuals_millipx(), i), from.cameras(i)});
  }
  return {};
}

Status decode_into(const v1::Snapshot& from, Snapshot& into) {
  if (from.has_views()) {
    if (const Status read = decode_views(from.views(), into.views); !read) return read;
  }
  if (const Status fits = within(from.subjects_size(), kMaxSubjects, "subjects"); !fits) return fits;
  for (const v1::SubjectState& subject : from.subjects()) {
    if (const Status read = decode_subject_state(subject, into); !read) return read;
  }
  return decode_unlabelled(from.unlabelled(), into.unlabelled);
}

}  // namespace

void put_at_rest_offsets(const v1::Snapshot& from, const Description& description, Snapshot& into) {
  for (const v1::SubjectState& subject : from.subjects()) {
    if (!subject.bones().local_positions_m().empty() || subject.subject() >= description.subjects.size()) continue;
    const auto& bones = description.subjects[subject.subject()].marker_set.skeleton.bones;
    for (SubjectPose& pose : into.poses) {
      if (pose.subject.value != subject.subject() || pose.bones.size() != bones.size()) continue;
      for (std::size_t i = 0; i < bones.size(); ++i) {
        BonePose& bone = pose.bones[i];
        if (bone.state == BoneState::Lost) continue;
        bone.parent_from_bone.position = bones[i].parent < 0 ? bone.world_from_bone.position : bones[i].rest_offset_m;
      }
    }
  }
}

Result<Snapshot> decode(const v1::Snapshot& from) {
  const Result<Instants> instants = decode_instants(from);
  if (!instants) return instants.error();
  if (from.expected_views() > kMaxCameras) {
    return wrong_snapshot(
        fmt::format("expected_views is {}, at most {} are allowed", from.expected_views(), kMaxCameras));
  }
  Snapshot into;
  if (from.has_timecode()) {
    into.timecode = timecode_of(from.timecode());
    if (!is_valid(*into.timecode)) {
      return wrong_snapshot(fmt::format("timecode is {} at {} frames per second, expected 00:00:00:00 to 23:59:59:FF",
                                        text_of(*into.timecode), into.timecode->frames_per_second));
    }
  }
  into.number = from.number();
  into.description_version = from.description_version();
  into.instants = *instants;
  into.expected_views = from.expected_views();
  if (const Status read = decode_into(from, into); !read) return read.error();
  return into;
}

}  // namespace mocap::wire
