#include "bridges/vrpn/senders.h"

#include <algorithm>

namespace mocap::vrpn {
namespace {

bool is_prop(const ClientSubject& subject) { return subject.bones().size() == 1; }

std::string bone_sender(const ClientSubject& subject, std::size_t bone) {
  return std::string(subject.name()) + '/' + subject.bones()[bone].name;
}

bool is_zero(mocap_vec3 v) { return v.x == 0.0F && v.y == 0.0F && v.z == 0.0F; }

// A feed without velocities has 0 for every bone.
bool has_velocities(const ClientSubject& subject) {
  const auto poses = subject.bone_poses();
  return std::any_of(poses.begin(), poses.end(),
                     [](const mocap_bone_pose& pose) { return !is_zero(pose.velocity) || !is_zero(pose.spin); });
}

std::string encode(const mocap_bone_pose& pose, bool with_velocity, std::int32_t sender, std::int32_t sensor,
                   Stamp at) {
  std::string bytes =
      message(at, sender, static_cast<std::int32_t>(Type::Pose), pose_payload(sensor, pose.position, pose.rotation));
  if (with_velocity) {
    bytes += message(at, sender, static_cast<std::int32_t>(Type::Velocity),
                     velocity_payload(sensor, pose.velocity, pose.spin));
  }
  return bytes;
}

mocap_bone_pose converted(const mocap_bone_pose& feed, const client::Axes& axes) {
  mocap_bone_pose pose = feed;
  pose.position = axes.place(feed.position);
  pose.rotation = axes.turn(feed.rotation);
  pose.velocity = axes.place(feed.velocity);
  pose.spin = axes.spin(feed.spin);
  return pose;
}

}  // namespace

bool Senders::add_name(const std::string& name) {
  if (numbers_.contains(name)) return false;
  if (name.empty() || name.size() > kMaxName_bytes || names_.size() >= kMaxSenders) {
    if (refused_.size() < kMaxSenders) refused_.emplace(name, true);
    return false;
  }
  numbers_.emplace(name, static_cast<std::int32_t>(names_.size()));
  names_.push_back(name);
  return true;
}

bool Senders::add(const ClientFrame& frame) {
  bool added = false;
  for (const ClientSubject& subject : frame.subjects()) {
    if (is_prop(subject) || offer_ != Offer::Bones) added |= add_name(std::string(subject.name()));
    if (is_prop(subject) || offer_ == Offer::Bodies) continue;
    for (std::size_t bone = 0; bone < subject.bones().size(); ++bone) added |= add_name(bone_sender(subject, bone));
  }
  return added;
}

std::optional<std::int32_t> Senders::find(std::string_view name) const {
  const auto found = numbers_.find(name);
  return found == numbers_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<Report> Senders::report(const ClientFrame& frame, const client::Axes& axes, std::int64_t unix_ns) const {
  std::vector<Report> reports;
  for (const ClientSubject& subject : frame.subjects()) {
    if (subject.tracked()) report_subject(subject, axes, stamp_of(unix_ns), reports);
  }
  return reports;
}

void Senders::report_subject(const ClientSubject& subject, const client::Axes& axes, Stamp at,
                             std::vector<Report>& into) const {
  const bool moving = has_velocities(subject);
  // A bone may have the name of a subject, so the offer decides too.
  const auto body = is_prop(subject) || offer_ != Offer::Bones ? find(subject.name()) : std::nullopt;
  const bool by_bone = !is_prop(subject) && offer_ != Offer::Bodies;
  for (std::size_t bone = 0; bone < subject.bone_poses().size(); ++bone) {
    if (subject.bone_poses()[bone].state == MOCAP_STATE_LOST) continue;
    const mocap_bone_pose pose = converted(subject.bone_poses()[bone], axes);
    const auto sensor = static_cast<std::int32_t>(bone);
    if (body) into.push_back({*body, by_bone, encode(pose, moving, *body, sensor, at)});
    if (!by_bone) continue;
    if (const auto own = find(bone_sender(subject, bone))) {
      into.push_back({*own, false, encode(pose, moving, *own, 0, at)});
    }
  }
}

}  // namespace mocap::vrpn
