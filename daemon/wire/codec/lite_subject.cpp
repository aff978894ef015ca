#include "wire/codec/lite_subject.h"

#include <algorithm>

#include "wire/codec/encode.h"
#include "wire/codec/encode_numbers.h"

namespace mocap::wire {
namespace {

template <class Things>
auto one_of(const Things& things, SubjectId subject) -> decltype(things.data()) {
  const auto found = std::find_if(things.begin(), things.end(), [&](const auto& t) { return t.subject == subject; });
  return found == things.end() ? nullptr : found;
}

bool is_off_rest(const Snapshot& from, const SubjectPose& pose, const Description& description) {
  return from.description_version != description.version || pose.subject.value >= description.subjects.size() ||
         !stands_at_rest_offsets(pose, description.subjects[pose.subject.value].marker_set.skeleton);
}

LiteBone lite_bone(const BonePose& from) {
  if (from.state == BoneState::Lost) return {};
  const auto& q = from.world_from_bone.rotation.coeffs();  // Eigen stores x y z w
  return {.lost = false, .rotation_xyzw = {q[0], q[1], q[2], q[3]}};
}

}  // namespace

LiteSubject::LiteSubject(const Snapshot& from, SubjectId subject, const Description& description)
    : from_(from),
      description_(description),
      labels_(one_of(from.labels, subject)),
      pose_(one_of(from.poses, subject)) {}

Lite LiteSubject::message(std::size_t index, std::int64_t utc_minus_host_ns) const {
  Lite lite;
  lite.phase = static_cast<std::uint8_t>(labels_ == nullptr ? v1::SUBJECT_PHASE_SEARCHING : code_of(labels_->phase));
  lite.description_version = from_.description_version;
  lite.number = from_.number;
  lite.exposed_at_utc_ns = to_ns(from_.instants.exposed_at) + utc_minus_host_ns;
  if (bones() == 0) return lite;
  lite.off_rest = is_off_rest(from_, *pose_, description_);
  const std::size_t first = index * kLiteBones;
  const Eigen::Vector3d& root = pose_->bones[0].world_from_bone.position;
  lite.root_m = {root.x(), root.y(), root.z()};
  lite.subject_bones = static_cast<std::uint8_t>(bones());
  lite.first_bone = static_cast<std::uint8_t>(first);
  lite.bone_count = std::min(kLiteBones, bones() - first);
  for (std::size_t i = 0; i < lite.bone_count; ++i) lite.bones[i] = lite_bone(pose_->bones[first + i]);
  return lite;
}

}  // namespace mocap::wire
