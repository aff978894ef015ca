#include "decode.h"

namespace mocap::client {
namespace {

mocap_quat inverse(mocap_quat q) { return {-q.x, -q.y, -q.z, q.w}; }

mocap_quat product(mocap_quat a, mocap_quat b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

void complete_bones(SubjectFrame& subject, const std::vector<mocap_bone>& bones) {
  for (std::size_t i = 0; i < subject.bones.size(); ++i) {
    mocap_bone_pose& pose = subject.bones[i];
    const std::int32_t parent = bones[i].parent;
    if (!subject.has_local_positions) pose.local_position = parent < 0 ? pose.position : bones[i].rest_offset;
    if (subject.has_local_rotations) continue;
    pose.local_rotation =
        parent < 0 ? pose.rotation
                   : product(inverse(subject.bones[static_cast<std::size_t>(parent)].rotation), pose.rotation);
  }
}

}  // namespace

const char* complete(Frame& frame, const Description& description) {
  for (SubjectFrame& subject : frame.subjects) {
    if (subject.subject >= description.subjects.size()) return "a subject without a description";
    const SubjectDescription& known = description.subjects[subject.subject];
    if (!subject.bones.empty() && subject.bones.size() != known.bones.size())
      return "bones that differ from the description";
    if (!subject.markers.empty() && subject.markers.size() != known.markers.size()) {
      return "markers that differ from the description";
    }
    complete_bones(subject, known.bones);
  }
  return nullptr;
}

}  // namespace mocap::client
