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

/// A marker whose label follows a naming convention.
struct KnownMarker {
  std::string bone;                                    ///< name in human18
  Eigen::Vector3d offset_m = Eigen::Vector3d::Zero();  ///< approximate, in the frame of the bone
};

/// Looks up a label of Plug-in Gait and related sets ("LASI", "Anna:LASI", "LFWT"), Motive ("LShoulderTop") or Arena
/// ("Skeleton_Hip2"). Nothing if the label is in none of these conventions.
std::optional<KnownMarker> known_marker(std::string_view label);

/// A label without the name of the subject: LASI of "Anna:LASI".
std::string_view without_subject(std::string_view label);

/// Whether any frame of a file has a point.
bool ever_there(const C3d& c3d, std::size_t point);

/// A marker set made from the labels of a C3D file.
struct ImportedMarkerSet {
  MarkerSet marker_set;              ///< markers in the order of the file, labels without the subject
  std::vector<std::string> unknown;  ///< omitted: labels of no convention, or of a bone that the skeleton lacks
  std::vector<std::string> twice;    ///< omitted: further points with the label of an earlier point
  std::size_t never_seen = 0;        ///< omitted: known labels without a sample
  std::size_t ghosts = 0;            ///< unlabelled points
  std::size_t model_outputs = 0;     ///< points computed by a model
};

/// Makes a marker set. Fails with InvalidArgument if fewer than four labels are known.
Result<ImportedMarkerSet> import_marker_set(const C3d& c3d, const Skeleton& skeleton, const std::string& name);

/// The positions of the markers of a set in a C3D file, by label, with z up. The up axis of the file, y or z, is the
/// one along which the markers are spread more, as people are taller than wide.
bodyfit::LabelledTake take_of(const C3d& c3d, const MarkerSet& set);

}  // namespace mocap::scene
