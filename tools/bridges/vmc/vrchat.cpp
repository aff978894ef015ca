#include "bridges/vmc/vrchat.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <string_view>

namespace mocap::vmc {
namespace {

// A tracker: the bone whose joint it is at and the bone with which it rotates, by the names of HumanBodyBones. A
// skeleton without the first bone has the tracker at `instead`.
struct Tracker {
  std::string_view address;
  std::string_view joint;
  std::string_view segment;
  std::string_view instead = {};
};

constexpr std::array<Tracker, 9> kTrackers{{
    {"1", "Hips", "Hips"},
    {"2", "Chest", "Chest", "Spine"},
    {"3", "LeftFoot", "LeftFoot"},
    {"4", "RightFoot", "RightFoot"},
    {"5", "LeftLowerLeg", "LeftUpperLeg"},
    {"6", "RightLowerLeg", "RightUpperLeg"},
    {"7", "LeftLowerArm", "LeftUpperArm"},
    {"8", "RightLowerArm", "RightUpperArm"},
    {"head", "Head", "Head"},
}};

bool has_bone(const ClientSubject& subject, std::string_view unity_name) {
  const auto bones = subject.bones();
  return std::any_of(bones.begin(), bones.end(), [&](const mocap_bone& bone) { return bone.unity_name == unity_name; });
}

// The pose of the bone with this name; nullptr: the skeleton has no such bone, or the bone is lost.
const mocap_bone_pose* find(const ClientSubject& subject, std::string_view unity_name) {
  const auto bones = subject.bones();
  for (std::size_t i = 0; i < subject.bone_poses().size(); ++i) {
    if (bones[i].unity_name != unity_name) continue;
    const mocap_bone_pose& pose = subject.bone_poses()[i];
    return pose.state == MOCAP_STATE_LOST ? nullptr : &pose;
  }
  return nullptr;
}

}  // namespace

mocap_vec3 unity_euler_deg(mocap_quat q) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  constexpr double kPole = 0.9999999;  // of sin x: the angles y and z are not separable within 0.03 degrees of the pole
  const double x = q.x;
  const double y = q.y;
  const double z = q.z;
  const double w = q.w;
  // Elements of the rotation matrix Ry(y) Rx(x) Rz(z).
  const double sin_x = std::clamp(2.0 * (w * x - y * z), -1.0, 1.0);
  const double pitch = std::asin(sin_x);
  double yaw = 0.0;
  double roll = 0.0;
  if (std::abs(sin_x) < kPole) {
    yaw = std::atan2(2.0 * (w * y + x * z), 1.0 - 2.0 * (x * x + y * y));
    roll = std::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (x * x + z * z));
  } else {
    yaw = std::atan2(2.0 * (w * y - x * z), 1.0 - 2.0 * (y * y + z * z));
  }
  return {static_cast<float>(pitch * kDegrees), static_cast<float>(yaw * kDegrees),
          static_cast<float>(roll * kDegrees)};
}

void write_trackers(const ClientSubject* subject, bool with_head, OscBundles& into) {
  into.clear();
  if (subject == nullptr || !subject->tracked()) return;
  for (const Tracker& tracker : kTrackers) {
    if (tracker.address == "head" && !with_head) continue;
    const bool replaced = !tracker.instead.empty() && !has_bone(*subject, tracker.joint);
    const mocap_bone_pose* joint = find(*subject, replaced ? tracker.instead : tracker.joint);
    const mocap_bone_pose* segment = find(*subject, replaced ? tracker.instead : tracker.segment);
    if (joint == nullptr || segment == nullptr) continue;
    const std::string address = "/tracking/trackers/" + std::string(tracker.address);
    const mocap_vec3 place = joint->position;
    const mocap_vec3 turn = unity_euler_deg(segment->rotation);
    into.add(address + "/position", "fff", {}, {}, {place.x, place.y, place.z});
    into.add(address + "/rotation", "fff", {}, {}, {turn.x, turn.y, turn.z});
  }
}

}  // namespace mocap::vmc
