#include "wire/codec/encode.h"

#include <algorithm>

#include "wire/codec/encode_numbers.h"

namespace mocap::wire {
namespace {

// Clears a column and reserves `count` entries, so that AddAlreadyReserved may follow.
template <class Column>
Column& fresh(Column* column, std::size_t count) {
  column->Clear();
  column->Reserve(static_cast<int>(count));
  return *column;
}

using Floats = google::protobuf::RepeatedField<float>;

void add(Floats& column, const Eigen::Vector3d& v) {
  for (const double x : v) column.AddAlreadyReserved(static_cast<float>(x));
}

void add(Floats& column, const Eigen::Quaterniond& q) {
  for (const double x : q.coeffs()) column.AddAlreadyReserved(static_cast<float>(x));  // Eigen stores x y z w
}

void encode_instants(const Instants& from, v1::Instants& into) {
  into.Clear();
  into.set_exposed_at_ns(to_ns(from.exposed_at));
  if (from.received_at) into.set_received_at_ns(to_ns(*from.received_at));
  if (from.detected_at) into.set_detected_at_ns(to_ns(*from.detected_at));
  if (from.fused_at) into.set_fused_at_ns(to_ns(*from.fused_at));
  if (from.sent_at) into.set_sent_at_ns(to_ns(*from.sent_at));
}

void encode_views(const BoundedVector<ViewStatus, kMaxCameras>& from, v1::Views& into) {
  auto& cameras = fresh(into.mutable_cameras(), from.size());
  auto& frame_numbers = fresh(into.mutable_frame_numbers(), from.size());
  auto& skews = fresh(into.mutable_skews_ns(), from.size());
  auto& blobs = fresh(into.mutable_blobs(), from.size());
  for (const ViewStatus& view : from) {
    cameras.AddAlreadyReserved(view.camera.value);
    frame_numbers.AddAlreadyReserved(view.frame_number);
    skews.AddAlreadyReserved(view.skew.count());
    blobs.AddAlreadyReserved(view.blobs);
  }
}

void encode_markers(const BoundedVector<LabelledMarker, kMaxLabels>& from, v1::LabelledMarkers& into) {
  auto& states = fresh(into.mutable_states(), from.size());
  auto& positions = fresh(into.mutable_positions_m(), 3 * from.size());
  auto& residuals = fresh(into.mutable_residuals_millipx(), from.size());
  auto& cameras = fresh(into.mutable_cameras(), from.size());
  auto& confidences = fresh(into.mutable_confidences_percent(), from.size());
  auto& tracks = fresh(into.mutable_track_ids_plus_one(), from.size());
  for (const LabelledMarker& marker : from) {
    const bool lost = marker.state == LabelState::Lost;
    states.AddAlreadyReserved(code_of(marker.state));
    add(positions, lost ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : marker.position.v);
    residuals.AddAlreadyReserved(lost ? 0 : millipx(marker.residual_px));
    cameras.AddAlreadyReserved(lost ? 0 : marker.cameras);
    confidences.AddAlreadyReserved(lost ? 0 : percent(marker.confidence));
    tracks.AddAlreadyReserved(lost ? 0 : plus_one(marker.track));
  }
}

void encode_velocities(const BoundedVector<BonePose, kMaxBones>& from, v1::BonePoses& into) {
  auto& velocities = fresh(into.mutable_velocities_m_s(), 3 * from.size());
  auto& spins = fresh(into.mutable_spins_rad_s(), 3 * from.size());
  const Eigen::Vector3d still = Eigen::Vector3d::Zero();
  for (const BonePose& bone : from) {
    const bool lost = bone.state == BoneState::Lost;
    add(velocities, lost ? still : bone.velocity_m_s);
    add(spins, lost ? still : bone.spin_rad_s);
  }
}

void encode_local_positions(const BoundedVector<BonePose, kMaxBones>& from, v1::BonePoses& into) {
  auto& positions = fresh(into.mutable_local_positions_m(), 3 * from.size());
  const Eigen::Vector3d nowhere = Eigen::Vector3d::Zero();
  for (const BonePose& bone : from) {
    add(positions, bone.state == BoneState::Lost ? nowhere : bone.parent_from_bone.position);
  }
}

void encode_bones(const BoundedVector<BonePose, kMaxBones>& from, const Parts& parts, v1::BonePoses& into) {
  auto& states = fresh(into.mutable_states(), from.size());
  auto& world_positions = fresh(into.mutable_world_positions_m(), 3 * from.size());
  auto& world_rotations = fresh(into.mutable_world_rotations_xyzw(), 4 * from.size());
  auto& local_rotations = fresh(into.mutable_local_rotations_xyzw(), 4 * from.size());
  auto& confidences = fresh(into.mutable_confidences_percent(), from.size());
  const BonePose nothing{};
  for (const BonePose& pose : from) {
    const BonePose& bone = pose.state == BoneState::Lost ? nothing : pose;
    states.AddAlreadyReserved(code_of(bone.state));
    add(world_positions, bone.world_from_bone.position);
    add(world_rotations, bone.world_from_bone.rotation);
    add(local_rotations, bone.parent_from_bone.rotation);
    confidences.AddAlreadyReserved(percent(bone.confidence));
  }
  into.clear_local_positions_m();
  into.clear_velocities_m_s();
  into.clear_spins_rad_s();
  if (parts.local_positions) encode_local_positions(from, into);
  if (parts.velocities) encode_velocities(from, into);
}

const SubjectPose* find(const Poses& poses, SubjectId subject) {
  const auto found = std::find_if(poses.begin(), poses.end(), [&](const auto& p) { return p.subject == subject; });
  return found == poses.end() ? nullptr : found;
}

const SubjectLabels* find(const Labels& labels, SubjectId subject) {
  const auto found = std::find_if(labels.begin(), labels.end(), [&](const auto& l) { return l.subject == subject; });
  return found == labels.end() ? nullptr : found;
}

void encode_subject(const SubjectLabels* labels, const SubjectPose* pose, const Parts& parts, v1::SubjectState& into) {
  into.set_subject(labels != nullptr ? labels->subject.value : pose->subject.value);
  into.set_phase(labels != nullptr ? code_of(labels->phase) : v1::SUBJECT_PHASE_UNSPECIFIED);
  if (labels != nullptr && parts.markers) {
    encode_markers(labels->markers, *into.mutable_markers());
  } else {
    into.clear_markers();
  }
  if (pose != nullptr && parts.bones) {
    encode_bones(pose->bones, parts, *into.mutable_bones());
    into.set_residual_m(static_cast<float>(pose->residual_m));
    into.set_smoothing_delay_s(static_cast<float>(pose->smoothing_delay_s));
  } else {
    into.clear_bones();
    into.clear_residual_m();
    into.clear_smoothing_delay_s();
  }
}

// RepeatedPtrField keeps the memory of removed elements and reuses it for added ones.
void encode_subjects(const Snapshot& from, const Parts& parts, v1::Snapshot& into) {
  auto& subjects = *into.mutable_subjects();
  int used = 0;
  const auto next = [&]() -> v1::SubjectState& {
    return used < subjects.size() ? *subjects.Mutable(used++) : (++used, *subjects.Add());
  };
  const auto wanted = [&](SubjectId subject) { return !parts.subject || *parts.subject == subject; };
  for (const SubjectLabels& labels : from.labels) {
    if (wanted(labels.subject)) encode_subject(&labels, find(from.poses, labels.subject), parts, next());
  }
  for (const SubjectPose& pose : from.poses) {
    if (wanted(pose.subject) && find(from.labels, pose.subject) == nullptr) {
      encode_subject(nullptr, &pose, parts, next());
    }
  }
  while (subjects.size() > used) subjects.RemoveLast();
}

void encode_unlabelled(const BoundedVector<UnlabelledMarker, kMaxMarkers>& from, v1::UnlabelledMarkers& into) {
  auto& tracks = fresh(into.mutable_track_ids_plus_one(), from.size());
  auto& positions = fresh(into.mutable_positions_m(), 3 * from.size());
  auto& residuals = fresh(into.mutable_residuals_millipx(), from.size());
  auto& cameras = fresh(into.mutable_cameras(), from.size());
  for (const UnlabelledMarker& marker : from) {
    tracks.AddAlreadyReserved(plus_one(marker.track));
    add(positions, marker.position.v);
    residuals.AddAlreadyReserved(millipx(marker.residual_px));
    cameras.AddAlreadyReserved(marker.cameras);
  }
}

// Positions in single precision have errors of about 1e-6 m. A larger difference is a real translation of the bone.
constexpr double kAtRest_m = 2e-6;

}  // namespace

bool stands_at_rest_offsets(const SubjectPose& pose, const Skeleton& skeleton) {
  if (pose.bones.size() != skeleton.bones.size()) return pose.bones.empty();
  for (std::size_t i = 0; i < pose.bones.size(); ++i) {
    const BonePose& bone = pose.bones[i];
    if (bone.state == BoneState::Lost) continue;
    const bool root = skeleton.bones[i].parent < 0;
    const Eigen::Vector3d& expected = root ? bone.world_from_bone.position : skeleton.bones[i].rest_offset_m;
    if ((bone.parent_from_bone.position - expected).cwiseAbs().maxCoeff() > kAtRest_m) return false;
  }
  return true;
}

bool stands_at_rest_offsets(const Snapshot& snapshot, const Description& description) {
  if (snapshot.description_version != description.version) return false;
  return std::all_of(snapshot.poses.begin(), snapshot.poses.end(), [&](const SubjectPose& pose) {
    return pose.subject.value < description.subjects.size() &&
           stands_at_rest_offsets(pose, description.subjects[pose.subject.value].marker_set.skeleton);
  });
}

void encode(const Snapshot& from, v1::Snapshot& into, const Parts& parts) {
  into.set_number(from.number);
  into.clear_sequence();
  into.set_description_version(from.description_version);
  encode_instants(from.instants, *into.mutable_instants());
  into.clear_utc_minus_host_ns();
  into.clear_synchronisation();
  if (from.timecode) {
    encode(*from.timecode, *into.mutable_timecode());
  } else {
    into.clear_timecode();
  }
  into.clear_description();
  into.clear_delivering_cameras();
  into.set_expected_views(from.expected_views);
  if (from.views.empty() || !parts.views) {
    into.clear_views();
  } else {
    encode_views(from.views, *into.mutable_views());
  }
  encode_subjects(from, parts, into);
  if (from.unlabelled.empty() || !parts.unlabelled) {
    into.clear_unlabelled();
  } else {
    encode_unlabelled(from.unlabelled, *into.mutable_unlabelled());
  }
}

}  // namespace mocap::wire
