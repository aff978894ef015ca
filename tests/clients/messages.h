#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "mocap/v1/description.pb.h"
#include "mocap/v1/snapshot.pb.h"

/// Messages of a feed, encoded by Protobuf's library as the reference for the decoders of the clients.
namespace mocap::client::testing {

inline constexpr std::int64_t kUtcMinusHost_ns = 1'700'000'000'000'000'000;

inline std::string envelope(const std::string& topic, const google::protobuf::MessageLite& message) {
  return topic + '\0' + message.SerializeAsString();
}

/// A description of subject "actor" with one bone and one marker.
inline v1::Description description(const std::string& protocol, std::uint32_t version, const std::string& session) {
  v1::Description said;
  said.set_protocol(protocol);
  said.set_version(version);
  said.set_session_id(session);
  v1::Subject& subject = *said.add_subjects();
  subject.set_name("actor");
  subject.add_bones()->set_name("Hips");
  subject.add_markers()->set_name("M");
  return said;
}

inline std::string description_message(const std::string& protocol = "mocap.v1", std::uint32_t version = 1,
                                       const std::string& session = "session") {
  return envelope("description", description(protocol, version, session));
}

/// A snapshot of this subject in phase Tracking. `pose` has position and rotation_xyzw of the bone, and optionally
/// velocity and spin.
inline v1::Snapshot snapshot(const nlohmann::json& pose) {
  v1::Snapshot said;
  said.set_description_version(1);
  said.set_utc_minus_host_ns(kUtcMinusHost_ns);
  v1::SubjectState& subject = *said.add_subjects();
  subject.set_phase(v1::SUBJECT_PHASE_TRACKING);
  v1::BonePoses& bones = *subject.mutable_bones();
  bones.add_states(v1::BONE_STATE_MEASURED);
  for (const float v : pose.at("position")) bones.add_world_positions_m(v);
  for (const float v : pose.at("rotation_xyzw")) bones.add_world_rotations_xyzw(v);
  if (!pose.contains("velocity")) return said;
  for (const float v : pose.at("velocity")) bones.add_velocities_m_s(v);
  for (const float v : pose.at("spin")) bones.add_spins_rad_s(v);
  return said;
}

inline std::string pose_message(const nlohmann::json& pose) { return envelope("snapshot", snapshot(pose)); }

inline std::string snapshot_message(std::uint64_t sequence, std::int64_t sent_ns, std::uint32_t version = 1) {
  v1::Snapshot said = snapshot({{"position", {0, 0, 1}}, {"rotation_xyzw", {0, 0, 0, 1}}});
  said.set_number(sequence + 1);
  said.set_sequence(sequence);
  said.set_description_version(version);
  said.mutable_instants()->set_exposed_at_ns(sent_ns);
  said.mutable_instants()->set_sent_at_ns(sent_ns);
  return envelope("snapshot", said);
}

/// A description with two bones; the second is 0.25 m in front of the first.
inline std::string two_bones_description() {
  v1::Description said = description("mocap.v1", 1, "session");
  v1::Bone& bone = *said.mutable_subjects(0)->add_bones();
  bone.set_name("Chest");
  bone.set_parent(0);
  bone.mutable_rest_offset_m()->set_x(0.25);
  return envelope("description", said);
}

inline std::string two_bones_snapshot(const std::vector<float>& rotations_xyzw) {
  v1::Snapshot said = snapshot({{"position", {0, 0, 1, 0, 0.25, 1}}, {"rotation_xyzw", rotations_xyzw}});
  said.mutable_subjects(0)->mutable_bones()->add_states(v1::BONE_STATE_FILLED);
  return envelope("snapshot", said);
}

}  // namespace mocap::client::testing
