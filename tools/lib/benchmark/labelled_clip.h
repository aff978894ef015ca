#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"

namespace mocap::benchmark {

/// A recording with true labels: the points of each frame, z up.
struct LabelledClip {
  std::string name;  ///< of the file, without folder and extension
  double rate_hz = 0.0;
  MarkerSet marker_set;                   ///< markers whose labels are known, not fitted to the person
  bodyfit::LabelledTake take;             ///< their positions; not finite: a gap
  std::vector<std::string> other;         ///< points of the file that are no markers of the set: ghosts, unknown labels
  std::vector<Eigen::Vector3d> others_m;  ///< frame after frame, one position for each of `other`; not finite: a gap

  std::size_t frames() const { return take.frames(); }
};

/// Reads a C3D or TRC file. The marker set follows the labels of the file (scene::import_marker_set) or, if most of
/// them follow no convention, the motion (functional::import_by_motion), or is read from `marker_set_file`. Model
/// outputs are omitted. Fails with NotFound, or with InvalidArgument and the reason.
Result<LabelledClip> load_labelled_clip(const std::filesystem::path& file,
                                        const std::optional<std::filesystem::path>& marker_set_file);

/// The marker set of the clip with bone lengths and offsets fitted to `take`, which has the markers of the clip; empty
/// if the take shows too few markers. `at_rest`: the take is a T-pose or A-pose.
std::optional<MarkerSet> fit_body(const LabelledClip& clip, const bodyfit::LabelledTake& take, bool at_rest);

/// The positions of the markers of `set` in rest pose, on the floor at the origin.
std::vector<Eigen::Vector3d> rest_positions_m(const MarkerSet& set);

}  // namespace mocap::benchmark
