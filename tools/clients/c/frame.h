#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mocap_client.h"

namespace mocap::client {

struct SubjectDescription {
  std::string name;
  std::string marker_set;
  std::string skeleton;
  std::vector<mocap_bone> bones;  ///< texts point into the description's `texts`
  std::vector<mocap_marker> markers;
};

/// The description of the feed. Immutable, so that frames share it.
struct Description {
  std::string protocol;
  std::uint32_t version = 0;
  std::string producer;
  std::string session;
  double nominal_rate_hz = 0.0;
  std::vector<std::string> cameras;  ///< names
  std::vector<SubjectDescription> subjects;
  std::deque<std::string> texts;  ///< owns the names of bones and markers; a deque does not move its elements

  Description() = default;
  Description(const Description&) = delete;
  Description& operator=(const Description&) = delete;
};

struct SubjectFrame {
  std::uint32_t subject = 0;  ///< index in the description
  std::int32_t phase = MOCAP_PHASE_SEARCHING;
  float residual_m = 0.0F;  ///< NaN: unknown
  float smoothing_delay_s = 0.0F;
  bool has_local_positions = false;
  bool has_local_rotations = false;
  std::vector<mocap_bone_pose> bones;
  std::vector<mocap_marker_pose> markers;
};

/// One snapshot.
struct Frame {
  std::uint64_t client = 0;  ///< client that filled the frame; 0: none
  std::uint64_t serial = 0;  ///< number of the snapshot in this client, from 1
  bool same_clock = false;   ///< daemon and client run on the same host
  mocap_frame_info info{};
  std::vector<SubjectFrame> subjects;
  std::vector<mocap_point> points;
  /// Shared, because a caller may keep a frame longer than the feed keeps this description.
  std::shared_ptr<const Description> description;
};

/// A health report. Immutable, so that readers share it.
struct Health {
  mocap_health_info info{};
  std::vector<mocap_camera_health> cameras;  ///< texts point into `texts`, as in all members below
  std::vector<mocap_latency> latencies;
  std::vector<mocap_recording> recordings;
  std::vector<std::string> searches;  ///< why subjects are not found: a sentence each
  std::deque<std::string> texts;

  Health() = default;
  Health(const Health&) = delete;
  Health& operator=(const Health&) = delete;
};

/// An event; `event.name` is empty until the indices are looked up in the description.
struct Event {
  mocap_event event{};
  std::optional<std::uint32_t> subject;
  std::optional<std::uint32_t> camera;
};

struct SubjectStatus {
  std::string name;
  std::int32_t phase = MOCAP_PHASE_SEARCHING;
  bool away = false;
};

/// The answer to a request, or the reason why none came.
struct Answer {
  std::uint64_t id = 0;
  std::int32_t code = MOCAP_CODE_NO_ANSWER;
  std::int32_t diagnosis = MOCAP_WELL;
  std::string message;
  bool has_status = false;
  std::string producer;
  std::string session;
  std::string role;
  bool capturing = false;
  std::vector<SubjectStatus> subjects;
  std::shared_ptr<const Health> health;
  std::string description;  ///< Protobuf; empty: the answer has none
  std::string snapshot;     ///< likewise
};

}  // namespace mocap::client

// The objects behind the handles of the C ABI.
struct mocap_frame {
  mocap::client::Frame frame;
};
struct mocap_health {
  std::shared_ptr<const mocap::client::Health> health;
};
struct mocap_answer {
  mocap::client::Answer answer;
};
