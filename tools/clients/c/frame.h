#pragma once

#include <cstdint>
#include <deque>
#include <memory>
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

/// What the feed says of itself. Does not change once made: frames share it.
struct Description {
  std::string protocol;
  std::uint32_t version = 0;
  std::string producer;
  std::string session;
  double nominal_rate_hz = 0.0;
  std::uint32_t cameras = 0;
  std::vector<SubjectDescription> subjects;
  std::deque<std::string> texts;  ///< names of bones and markers, where they stay

  Description() = default;
  Description(const Description&) = delete;
  Description& operator=(const Description&) = delete;
};

struct SubjectFrame {
  std::uint32_t subject = 0;  ///< index in the description
  std::int32_t phase = MOCAP_PHASE_SEARCHING;
  float residual_m = 0.0F;  ///< NaN: not known
  float smoothing_delay_s = 0.0F;
  bool has_local_positions = false;
  bool has_local_rotations = false;
  std::vector<mocap_bone_pose> bones;
  std::vector<mocap_marker_pose> markers;
};

/// One snapshot.
struct Frame {
  std::uint64_t client = 0;  ///< that filled it; 0: nobody
  std::uint64_t serial = 0;  ///< counts what this client received, from 1
  bool same_clock = false;   ///< the daemon's host is this one
  mocap_frame_info info{};
  std::vector<SubjectFrame> subjects;
  std::vector<mocap_point> points;
  /// Shared: a caller may keep its frame longer than the feed keeps this description.
  std::shared_ptr<const Description> description;
};

struct CameraNews {
  std::string name;
  bool streaming = false;
  bool ended = false;    ///< a finite source has given all it has
  bool stopped = false;  ///< by an operator
  std::string last_error;
};

/// What of a health report tells why there is no data.
struct Health {
  std::vector<CameraNews> cameras;
};

}  // namespace mocap::client

/// What the C ABI's handle points to.
struct mocap_frame {
  mocap::client::Frame frame;
};
