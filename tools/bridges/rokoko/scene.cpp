#include "bridges/rokoko/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <vector>

#include "bridges/lib/quaternion.h"
#include "bridges/rokoko/bones.h"

namespace mocap::rokoko {
namespace {

// A bone's pose: the position of its joint, and its rotation from the T-pose.
struct Pose {
  mocap_vec3 position{};
  mocap_quat rotation{0.0F, 0.0F, 0.0F, 1.0F};
};

// A JSON string with its quotes. Names come from the feed; bytes that are not UTF-8 are replaced.
std::string quoted(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

// Shortest decimal numbers that give the same float again; 0 for -0.
void put_pose(std::string& into, mocap_vec3 p, mocap_quat q) {
  fmt::format_to(std::back_inserter(into),
                 R"("position":{{"x":{},"y":{},"z":{}}},"rotation":{{"x":{},"y":{},"z":{},"w":{}}})", p.x + 0.0F,
                 p.y + 0.0F, p.z + 0.0F, q.x + 0.0F, q.y + 0.0F, q.z + 0.0F, q.w + 0.0F);
}

// Index of the bone with this name in HumanBodyBones; empty: none.
std::optional<std::size_t> find(const ClientSubject& subject, std::string_view unity_name) {
  const auto bones = subject.bones();
  const auto found = std::find_if(bones.begin(), bones.end(), [&](const mocap_bone& bone) {
    return !unity_name.empty() && bone.unity_name == unity_name;
  });
  if (found == bones.end()) return std::nullopt;
  return static_cast<std::size_t>(found - bones.begin());
}

bool has_hand(const ClientSubject& subject, Section side) {
  const auto bones = all_bones();
  return std::any_of(bones.begin(), bones.end(), [&](const Bone& bone) {
    return bone.section == side && find(subject, bone.unity_name).has_value();
  });
}

// The poses of all bones of Rokoko's body, in their order.
std::vector<Pose> pose_body(const ClientSubject& subject) {
  std::vector<Pose> poses;
  for (const Bone& bone : all_bones()) {
    Pose pose = bone.parent < 0 ? Pose{} : poses[static_cast<std::size_t>(bone.parent)];
    if (const auto index = find(subject, bone.unity_name)) {
      const mocap_bone_pose& known = subject.bone_poses()[*index];
      if (known.state != MOCAP_STATE_LOST) pose = {known.position, known.rotation};
    }
    poses.push_back(pose);
  }
  return poses;
}

// Height of the hips above the sole in the T-pose, m, and of the top bone's joint: the lengths of the rest pose.
struct Heights {
  float hips = 0.0F;
  float total = 0.0F;
};

// `up` is y: a frame in Unity's axes has rest offsets in Unity's axes.
Heights measure(const ClientSubject& subject) {
  const auto bones = subject.bones();
  std::vector<float> heights(bones.size(), 0.0F);
  for (std::size_t i = 0; i < bones.size(); ++i) {
    if (bones[i].parent >= 0) {
      heights[i] = heights[static_cast<std::size_t>(bones[i].parent)] + bones[i].rest_offset.y;
    }
  }
  const auto [lowest, highest] = std::minmax_element(heights.begin(), heights.end());
  const auto hips = find(subject, "Hips");
  if (!hips) return {};
  return {heights[*hips] - *lowest, *highest - *lowest};
}

void put_actor(std::string& into, const ClientSubject& subject) {
  const bool left = has_hand(subject, Section::LeftGlove);
  const bool right = has_hand(subject, Section::RightGlove);
  const Heights heights = measure(subject);
  fmt::format_to(std::back_inserter(into),
                 R"({{"name":{},"color":[128,128,128],"meta":{{"hasGloves":{},"hasLeftGlove":{},"hasRightGlove":{},)"
                 R"("hasBody":true,"hasFace":false}},"dimensions":{{"totalHeight":{},"hipHeight":{}}},"body":{{)",
                 quoted(subject.name()), left || right, left, right, heights.total, heights.hips);
  const std::vector<Pose> poses = pose_body(subject);
  const auto bones = all_bones();
  for (std::size_t i = 0; i < bones.size(); ++i) {
    if (bones[i].section == Section::LeftGlove && !left) continue;
    if (bones[i].section == Section::RightGlove && !right) continue;
    fmt::format_to(std::back_inserter(into), R"({}"{}":{{)", i == 0 ? "" : ",", bones[i].name);
    put_pose(into, poses[i].position, bridge::product(poses[i].rotation, bones[i].rest));
    into += '}';
  }
  into += "}}";
}

void put_prop(std::string& into, const ClientSubject& subject) {
  const mocap_bone_pose& pose = subject.bone_poses()[0];
  fmt::format_to(std::back_inserter(into), R"({{"name":{},"color":[128,128,128],"type":0,)", quoted(subject.name()));
  put_pose(into, pose.position, pose.rotation);
  into += '}';
}

struct Scene {
  std::string actors;
  std::string props;
};

Scene write_subjects(const ClientFrame* frame, const std::string& wanted) {
  Scene scene;
  if (frame == nullptr) return scene;
  for (const ClientSubject& subject : frame->subjects()) {
    if (!wanted.empty() && subject.name() != wanted) continue;
    if (!subject.tracked() || subject.bone_poses().empty()) continue;
    const auto hips = find(subject, "Hips");
    if (subject.bone_poses()[hips.value_or(0)].state == MOCAP_STATE_LOST) continue;
    const bool person = hips.has_value();
    std::string& into = person ? scene.actors : scene.props;
    if (!into.empty()) into += ',';
    person ? put_actor(into, subject) : put_prop(into, subject);
  }
  return scene;
}

double scene_time_s(const ClientFrame* frame, double otherwise_s) {
  constexpr double kNanosecond_s = 1e-9;
  if (frame == nullptr) return otherwise_s;
  const std::int64_t exposed_at_ns = frame->info().exposed_at_ns;
  return exposed_at_ns == MOCAP_ABSENT ? otherwise_s : static_cast<double>(exposed_at_ns) * kNanosecond_s;
}

}  // namespace

std::string write_scene(const ClientFrame* frame, const SceneOptions& options, double time_s) {
  const Scene scene = write_subjects(frame, options.subject);
  return fmt::format(
      R"({{"version":3,"fps":{},"scene":{{"timestamp":{:.6f},"actors":[{}],"characters":[],"props":[{}]}}}})",
      options.rate_hz, scene_time_s(frame, time_s), scene.actors, scene.props);
}

}  // namespace mocap::rokoko
