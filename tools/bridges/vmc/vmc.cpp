#include "bridges/vmc/vmc.h"

#include "bridges/lib/quaternion.h"

namespace mocap::vmc {
namespace {

using bridge::inverse;
using bridge::product;

// The nearest ancestor that has a name in HumanBodyBones and a known pose; -1: none.
int known_parent(const ClientSubject& subject, int bone) {
  const auto bones = subject.bones();
  for (int at = bones[static_cast<std::size_t>(bone)].parent; at >= 0;
       at = bones[static_cast<std::size_t>(at)].parent) {
    const auto index = static_cast<std::size_t>(at);
    if (*bones[index].unity_name != '\0' && subject.bone_poses()[index].state != MOCAP_STATE_LOST) return at;
  }
  return -1;
}

void say_bone(const ClientSubject& subject, std::size_t bone, OscBundles& into) {
  const mocap_bone_pose& pose = subject.bone_poses()[bone];
  mocap_vec3 place = pose.position;
  mocap_quat turn = pose.rotation;
  if (const int above = known_parent(subject, static_cast<int>(bone)); above >= 0) {
    const mocap_bone_pose& parent = subject.bone_poses()[static_cast<std::size_t>(above)];
    const mocap_quat back = inverse(parent.rotation);
    place =
        bridge::rotated(back, {place.x - parent.position.x, place.y - parent.position.y, place.z - parent.position.z});
    turn = product(back, turn);
  }
  into.add("/VMC/Ext/Bone/Pos", "sfffffff", subject.bones()[bone].unity_name, {},
           {place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w});
}

}  // namespace

void write_frame(const ClientSubject* subject, float time_s, OscBundles& into) {
  constexpr int kCalibrated = 3;
  const bool tracked = subject != nullptr && subject->tracked() && !subject->bone_poses().empty();
  into.clear();
  // loaded, calibration state, calibration mode, tracking status
  into.add("/VMC/Ext/OK", "iiii", {}, {1, kCalibrated, 0, tracked ? 1 : 0}, {});
  into.add("/VMC/Ext/T", "f", {}, {}, {time_s});
  if (!tracked) return;
  into.add("/VMC/Ext/Root/Pos", "sfffffff", "root", {}, {0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 0.0F, 1.0F});
  for (std::size_t i = 0; i < subject->bone_poses().size(); ++i) {
    const bool known = *subject->bones()[i].unity_name != '\0' && subject->bone_poses()[i].state != MOCAP_STATE_LOST;
    if (known) say_bone(*subject, i, into);
  }
}

}  // namespace mocap::vmc
