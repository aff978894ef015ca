#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/rational_rate.h"
#include "model/clock/timecode.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "model/transform.h"

namespace mocap::exports {

/// One marker in one frame, in the world frame.
struct MarkerSample {
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< without meaning when Lost
  LabelState state = LabelState::Lost;
  float residual_m = 0.0F;   ///< rms distance from the viewing rays; 0 if not measured
  std::uint8_t cameras = 0;  ///< number of cameras that saw the marker
};

/// One bone in one frame.
struct BoneSample {
  Pose parent_from_bone;  ///< the root's parent is the world
  BoneState state = BoneState::Lost;
};

/// One subject of a clip: its definition with the fitted offsets, and its markers and bones frame by frame. Samples of
/// frame f begin at f * (number of markers or bones).
struct ClipSubject {
  Subject subject;
  std::vector<MarkerSample> markers;
  std::vector<BoneSample> bones;
};

/// A named instant of a take, for example a mark of the operator.
struct ClipEvent {
  double time_s = 0.0;  ///< after the first frame
  std::string name;
};

using ClipTimecode = Timecode;

/// A take, or a range of it, at a constant frame rate: the input of all writers of this folder. World frame: m,
/// right-handed, z up, floor z = 0.
struct Clip {
  std::string name;      ///< of the take
  std::string producer;  ///< program and version
  Rate rate;
  std::size_t frames = 0;
  std::int64_t first_frame = 0;                ///< number of the first frame within the take, at `rate`
  std::optional<std::int64_t> first_utc_ns;    ///< since the Unix epoch
  std::optional<ClipTimecode> first_timecode;  ///< empty: the take has no timecode
  std::vector<ClipSubject> subjects;
  std::vector<ClipEvent> events;
};

}  // namespace mocap::exports
