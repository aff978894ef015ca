#pragma once

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "clients/messages.h"
#include "feed.h"
#include "frame.h"
#include "mocap_client.hpp"

/// Frames of the C++ client without a connection, for the encoders of the bridges.
namespace mocap::bridge::testing {

/// One bone of a subject: name, name in HumanBodyBones (may be empty) and index of the parent (-1: none).
struct TestBone {
  std::string name;
  std::string unity_name;
  int parent = -1;
};

struct TestSubject {
  std::string name = "actor";
  std::vector<TestBone> bones = {{"Hips", "Hips", -1}};
  /// For each bone, in the axes of the feed: 3 floats and 4 floats x y z w. Empty: the subject is not tracked.
  std::vector<std::vector<float>> poses = {{0, 0, 1, 0, 0, 0, 1}};
  /// For each bone 3 floats each, m/s and rad/s; empty: the feed has none.
  std::vector<float> velocities = {};
  std::vector<float> spins = {};
  std::vector<std::size_t> lost = {};  ///< indices of lost bones
};

inline constexpr std::int64_t kExposed_ns = 5'250'000'000;
inline constexpr std::int64_t kUtcMinusHost_ns = client::testing::kUtcMinusHost_ns;

inline v1::Description describe(const std::vector<TestSubject>& subjects) {
  v1::Description said;
  said.set_protocol("mocap.v1");
  said.set_version(1);
  said.set_session_id("session");
  for (const TestSubject& from : subjects) {
    v1::Subject& subject = *said.add_subjects();
    subject.set_name(from.name);
    for (const TestBone& bone : from.bones) {
      v1::Bone& to = *subject.add_bones();
      to.set_name(bone.name);
      to.set_unity_name(bone.unity_name);
      if (bone.parent < 0) continue;
      to.set_parent(static_cast<std::uint32_t>(bone.parent));
      to.mutable_rest_offset_m()->set_z(0.25);
    }
  }
  return said;
}

inline v1::Snapshot snapshot(const std::vector<TestSubject>& subjects) {
  v1::Snapshot said;
  said.set_number(1);
  said.set_description_version(1);
  said.set_utc_minus_host_ns(kUtcMinusHost_ns);
  said.mutable_instants()->set_exposed_at_ns(kExposed_ns);
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    v1::SubjectState& subject = *said.add_subjects();
    subject.set_subject(static_cast<std::uint32_t>(i));
    subject.set_phase(subjects[i].poses.empty() ? v1::SUBJECT_PHASE_SEARCHING : v1::SUBJECT_PHASE_TRACKING);
    if (subjects[i].poses.empty()) continue;
    v1::BonePoses& bones = *subject.mutable_bones();
    for (const std::vector<float>& pose : subjects[i].poses) {
      bones.add_states(v1::BONE_STATE_MEASURED);
      for (std::size_t k = 0; k < 3; ++k) bones.add_world_positions_m(pose[k]);
      for (std::size_t k = 3; k < 7; ++k) bones.add_world_rotations_xyzw(pose[k]);
    }
    for (const std::size_t bone : subjects[i].lost) bones.set_states(static_cast<int>(bone), v1::BONE_STATE_LOST);
    for (const float v : subjects[i].velocities) bones.add_velocities_m_s(v);
    for (const float v : subjects[i].spins) bones.add_spins_rad_s(v);
  }
  return said;
}

/// A frame with these subjects in the given axes.
class TestFrame {
 public:
  explicit TestFrame(const std::vector<TestSubject>& subjects, int axes = MOCAP_AXES_MOCAP)
      : TestFrame(describe(subjects), snapshot(subjects), axes) {}
  TestFrame(const v1::Description& description, const v1::Snapshot& snapshot, int axes) {
    constexpr std::int64_t kNow_ns = 6'000'000'000;
    const client::Now now{kNow_ns, kNow_ns + kUtcMinusHost_ns};
    client::Feed feed({"tcp://127.0.0.1:5570", "snapshot", axes, 1, 1});
    feed.note({.connected = true, .since_ns = 0, .connections = 1});
    feed.take(client::testing::envelope("description", description), now);
    feed.take(client::testing::envelope("snapshot", snapshot), now);
    filled_ = feed.hand_out(frame_.raw()->frame, now);
  }

  /// False: the client refused the frame, which is a fault of the test.
  bool filled() const { return filled_; }
  const ClientFrame& get() const { return frame_; }

 private:
  ClientFrame frame_;
  bool filled_ = false;
};

/// The axis vectors of proto/axes.
inline std::vector<nlohmann::json> axis_vectors(const std::filesystem::path& source) {
  std::vector<nlohmann::json> cases;
  for (const auto& file : std::filesystem::directory_iterator(source / "proto/axes")) {
    if (file.path().extension() != ".json") continue;
    std::ifstream in(file.path());
    cases.push_back(nlohmann::json::parse(in));
  }
  return cases;
}

/// The pose of an axis vector in the axes of the feed, for TestSubject::poses.
inline std::vector<float> feed_pose(const nlohmann::json& vector) {
  std::vector<float> pose = vector.at("mocap").at("position");
  for (const float v : vector.at("mocap").at("rotation_xyzw")) pose.push_back(v);
  return pose;
}

}  // namespace mocap::bridge::testing
