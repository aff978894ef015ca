#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/skeleton.h"
#include "settings/faults.h"

namespace mocap::settings {

/// A fitted body.
struct SubjectFile {
  std::string name;
  std::filesystem::path marker_set_file;   ///< bones, limits, aliases, colours
  std::string fitted_on;                   ///< date and time of the fit; UTC, ISO 8601
  double size = 1.0;                       ///< size of the body relative to that of the marker set
  double residual_m = 0.0;                 ///< rms distance of the markers from the body; 0: unknown
  MarkerSet marker_set;                    ///< with the offsets of this body
  std::vector<double> bone_residuals_m;    ///< by bone; 0: unknown
  std::vector<double> marker_residuals_m;  ///< by marker; 0: unknown
};

/// Reads a subject file and the marker set that it names. Fails with all faults, such as another format, or a marker or
/// bone that only one of the two files has.
Result<SubjectFile, Faults> load_subject(const std::filesystem::path& path);

/// Writes a subject file; reading it gives the same bits. The file is replaced as a whole or, if that fails, not at
/// all.
Status save_subject(const std::filesystem::path& path, const SubjectFile& subject);

/// Writes a marker set in the format of load_marker_set. The path of the skeleton is written relative to `path`.
Status save_marker_set(const std::filesystem::path& path, const MarkerSet& set,
                       const std::filesystem::path& skeleton_file);

/// Writes a skeleton in the format of load_skeleton.
Status save_skeleton(const std::filesystem::path& path, const Skeleton& skeleton);

}  // namespace mocap::settings
