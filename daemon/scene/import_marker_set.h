#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "bodyfit/fit_subject.h"
#include "model/skeleton.h"
#include "scene/c3d.h"

namespace mocap::scene {

/// Where a marker sits whose name follows a convention: on which bone of human18, and about where from its joint.
struct KnownMarker {
  std::string bone;
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();
};

/// Looks a label up: Plug-in Gait and its kin ("LASI", "Anna:LASI", "LFWT"), Motive ("LShoulderTop"), Arena
/// ("Skeleton_Hip2"). Nothing where no convention knows it.
std::optional<KnownMarker> known_marker(std::string_view label);

/// A label without the subject's name before it: "Anna:LASI" is LASI.
std::string_view without_subject(std::string_view label);

/// A marker set made of a C3D file's labels.
struct ImportedMarkerSet {
  MarkerSet marker_set;              ///< markers in the order of the file, named without the subject
  std::vector<std::string> unknown;  ///< labels that no convention knows, or whose bone the skeleton lacks; left out
  std::vector<std::string> twice;    ///< labels that stand more than once; the first counts
  std::size_t never_seen = 0;        ///< known labels of which the file has no sample; left out
  std::size_t ghosts = 0;            ///< nameless points
  std::size_t model_outputs = 0;     ///< what a model computed
};

/// Fails with InvalidArgument when too few labels are known to make a body of (less than four).
Result<ImportedMarkerSet> import_marker_set(const C3d& c3d, const Skeleton& skeleton, const std::string& name);

/// The places of a set's markers in a C3D file by their names, z up: the axis along which the markers lie furthest
/// apart is taken for up, as people are taller than wide.
bodyfit::LabelledTake take_of(const C3d& c3d, const MarkerSet& set);

}  // namespace mocap::scene
