#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/snapshot.h"

namespace mocap::scoring {

struct NamedMarker {
  std::uint32_t subject;
  std::uint32_t marker;
  LabelState state;  ///< never Lost: those are left out
  Eigen::Vector3d position_m;
  std::uint32_t cameras = 0;  ///< that see it
};

struct PosedBone {
  std::uint32_t subject;
  std::uint32_t bone;
  BoneState state;  ///< never Lost: those are left out
  Eigen::Vector3d position_m;
  Eigen::Quaterniond rotation;
};

/// How a snapshot says that it stands with a subject.
struct SubjectSaid {
  std::uint32_t subject;
  SubjectPhase phase;
  bool whole;  ///< there is a pose, and every bone is in it
};

/// What scoring needs of a snapshot: a few kilobytes, so that long takes fit.
struct EvalFrame {
  std::uint64_t number = 0;  ///< of the message in its topic where it bears one, of the set otherwise
  Timestamp exposed_at;
  std::uint32_t views = 0;
  std::uint32_t expected_views = 0;
  std::vector<NamedMarker> markers;  ///< by subject, then by marker
  std::vector<PosedBone> bones;      ///< by subject, then by bone
  std::vector<Eigen::Vector3d> unlabelled_m;
  std::vector<SubjectSaid> subjects;
};

/// Reads a file of JSON lines ("-": standard input), in the order in which it stands. Empty lines are passed over. A
/// last line without its end that cannot be read is left out: its writer was stopped in the middle of it. Fails with
/// NotFound, Io, or InvalidArgument, which names file and line.
Result<std::vector<EvalFrame>> read_frames(const std::string& path);

EvalFrame frame_of(const Snapshot& snapshot);

}  // namespace mocap::scoring
