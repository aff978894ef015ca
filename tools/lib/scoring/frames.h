#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/snapshot.h"

namespace mocap::scoring {

struct NamedMarker {
  std::uint32_t subject;
  std::uint32_t marker;
  LabelState state;  ///< never Lost: lost markers are left out
  Eigen::Vector3d position_m;
  std::uint32_t cameras = 0;  ///< number of cameras that see the marker; 0 if unknown
};

struct PosedBone {
  std::uint32_t subject;
  std::uint32_t bone;
  BoneState state;  ///< never Lost: lost bones are left out
  Eigen::Vector3d position_m;
  Eigen::Quaterniond rotation;
};

/// The state of one subject in a snapshot.
struct SubjectSaid {
  std::uint32_t subject;
  SubjectPhase phase;
  bool whole;  ///< the subject has a pose that contains every bone
};

/// The part of a snapshot that scoring needs: a few kilobytes, so that long takes fit into memory.
struct EvalFrame {
  std::uint64_t number =
      0;  ///< sequence number of the message in its topic if present, otherwise the number of the frame set
  Timestamp exposed_at;
  std::uint32_t views = 0;
  std::uint32_t expected_views = 0;
  std::vector<NamedMarker> markers;  ///< sorted by subject, then by marker
  std::vector<PosedBone> bones;      ///< sorted by subject, then by bone
  std::vector<Eigen::Vector3d> unlabelled_m;
  std::vector<SubjectSaid> subjects;
};

/// Reads a file of JSON lines ("-": standard input) in file order. Skips empty lines, and a last line that lacks its
/// newline and cannot be parsed (the writer was interrupted). Fails with NotFound, Io, or InvalidArgument with file and
/// line.
Result<std::vector<EvalFrame>> read_frames(const std::string& path);

EvalFrame frame_of(const Snapshot& snapshot);

}  // namespace mocap::scoring
