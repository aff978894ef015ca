#include "bridges/natnet/scene.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "bridges/lib/quaternion.h"

namespace mocap::natnet {
namespace {

using bridge::product;
using bridge::rotated;

// How long frames have the flag that the models changed: a client that lost packets sees it too.
constexpr std::int64_t kChanged_ns = 250'000'000;
// Clocks of one machine differ by the time between two readings of the clock; other machines by more than that.
constexpr std::int64_t kSameClock_ns = 1'000'000;

mocap_vec3 sum(mocap_vec3 a, mocap_vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }

BonePose at_rest(const Model& model, std::size_t bone) {
  const int parent = model.bones[bone].parent;
  BonePose pose;
  if (parent < 0) return pose;
  const BonePose& above = model.poses[static_cast<std::size_t>(parent)];
  pose.local_position = model.bones[bone].rest_offset;
  pose.position = sum(above.position, rotated(above.rotation, pose.local_position));
  pose.rotation = above.rotation;
  return pose;
}

BonePose measured(const mocap_bone_pose& pose) {
  return {pose.position, pose.rotation, pose.local_position, pose.local_rotation, true};
}

void read_poses(Model& model, std::span<const mocap_bone_pose> poses) {
  for (std::size_t i = 0; i < model.bones.size(); ++i) {
    const bool known = i < poses.size() && poses[i].state != MOCAP_STATE_LOST;
    model.poses[i] = known ? measured(poses[i]) : at_rest(model, i);
  }
}

MarkerPose from_model(const Model& model, std::size_t marker) {
  const Marker& one = model.markers[marker];
  const auto bone = static_cast<std::size_t>(one.bone);
  if (one.bone < 0 || bone >= model.poses.size()) return {};
  const BonePose& pose = model.poses[bone];
  return {sum(pose.position, rotated(pose.rotation, one.offset)), pose.tracked, false};
}

void read_markers(Model& model, std::span<const mocap_marker_pose> poses) {
  for (std::size_t i = 0; i < model.markers.size(); ++i) {
    const bool known = i < poses.size() && poses[i].state != MOCAP_STATE_LOST;
    model.marker_poses[i] =
        known ? MarkerPose{poses[i].position, true, poses[i].state == MOCAP_STATE_MEASURED} : from_model(model, i);
  }
}

Model describe_subject(const ClientSubject& subject, std::int32_t id) {
  Model model;
  model.name = subject.name();
  model.id = id;
  for (const mocap_bone& bone : subject.bones()) {
    model.bones.push_back({bone.name, bone.unity_name, bone.parent, bone.rest_offset});
  }
  for (const mocap_marker& marker : subject.markers()) {
    model.markers.push_back({marker.name, marker.bone, marker.offset});
  }
  model.poses.resize(model.bones.size());
  model.marker_poses.resize(model.markers.size());
  return model;
}

std::uint32_t timecode_of(const mocap_frame_info& info) {
  if (info.timecode_rate == 0) return 0;
  return static_cast<std::uint32_t>(info.timecode_hours) << 24U |
         static_cast<std::uint32_t>(info.timecode_minutes) << 16U |
         static_cast<std::uint32_t>(info.timecode_seconds) << 8U | info.timecode_frames;
}

std::int32_t number_of(std::uint64_t count) { return static_cast<std::int32_t>(count & 0x7FFFFFFFU); }

// The upper 16 bits of the id of a marker name its model, so they are 0 here.
std::int32_t unlabelled_id(std::uint32_t track) {
  constexpr std::uint32_t kIds = 0xFFFF;
  return track == 0 ? 0 : static_cast<std::int32_t>((track - 1) % kIds + 1);
}

}  // namespace

void SceneReader::describe(const ClientFrame& frame) {
  scene_.models.clear();
  scene_.rate_hz = static_cast<float>(mocap_frame_nominal_rate_hz(frame.raw()));
  std::int32_t id = 0;
  for (const ClientSubject& subject : frame.subjects()) scene_.models.push_back(describe_subject(subject, ++id));
}

// Converts the daemon's instants to this machine's clock. The difference of the clocks is kept until it changes, so
// that intervals between frames stay exact.
void SceneReader::read_instants(const mocap_frame_info& info, std::optional<std::int64_t> age_ns, std::int64_t now_ns) {
  if (info.exposed_at_ns == MOCAP_ABSENT) {
    scene_.exposed_ns = scene_.received_ns = static_cast<std::uint64_t>(now_ns);
    return;
  }
  const std::int64_t offset_ns = age_ns ? now_ns - *age_ns - info.exposed_at_ns : 0;
  if (std::abs(offset_ns - offset_ns_) > kSameClock_ns) offset_ns_ = offset_ns;
  if (std::abs(offset_ns) <= kSameClock_ns) offset_ns_ = 0;
  const std::int64_t received_ns = info.received_at_ns == MOCAP_ABSENT ? info.exposed_at_ns : info.received_at_ns;
  scene_.exposed_ns = static_cast<std::uint64_t>(info.exposed_at_ns + offset_ns_);
  scene_.received_ns = static_cast<std::uint64_t>(received_ns + offset_ns_);
}

const Scene& SceneReader::read(const ClientFrame& frame, bool anew, std::int64_t now_ns) {
  const mocap_frame_info info = frame.info();
  if (anew || scene_.models.size() != info.subject_count) {
    describe(frame);
    changed_ns_ = now_ns;
  }
  scene_.models_changed = now_ns - changed_ns_ < kChanged_ns;
  scene_.number = number_of(info.number);
  scene_.timecode = timecode_of(info);
  scene_.subframe = info.timecode_subframe;
  read_instants(info, frame.age_ns(), now_ns);
  for (std::size_t i = 0; i < scene_.models.size(); ++i) {
    const auto subject = frame.subject(i);
    Model& model = scene_.models[i];
    const bool tracked = subject && subject->tracked();
    const float residual_m = tracked ? subject->raw().residual_m : 0.0F;
    model.error_m = std::isfinite(residual_m) ? residual_m : 0.0F;
    read_poses(model, tracked ? subject->bone_poses() : std::span<const mocap_bone_pose>{});
    read_markers(model, subject ? subject->marker_poses() : std::span<const mocap_marker_pose>{});
  }
  scene_.unlabelled.clear();
  for (const mocap_point& point : frame.points()) {
    scene_.unlabelled.push_back({point.position, unlabelled_id(point.track)});
  }
  return scene_;
}

const Scene& SceneReader::lose(std::int64_t now_ns) {
  scene_.models_changed = false;
  scene_.number = number_of(static_cast<std::uint64_t>(scene_.number) + 1);
  scene_.exposed_ns = scene_.received_ns = static_cast<std::uint64_t>(now_ns);
  scene_.timecode = scene_.subframe = 0;
  for (Model& model : scene_.models) {
    model.error_m = 0.0F;
    read_poses(model, {});
    read_markers(model, {});
  }
  scene_.unlabelled.clear();
  return scene_;
}

}  // namespace mocap::natnet
