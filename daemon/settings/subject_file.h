#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/skeleton.h"
#include "settings/faults.h"

namespace mocap::settings {

/// A body as it was fitted, and what it was made of.
struct SubjectFile {
  std::string name;
  std::filesystem::path marker_set_file;   ///< of config/markersets: bones, limits, aliases, colours
  std::string fitted_on;                   ///< date and time, as whoever fitted it told them; UTC, ISO 8601
  double size = 1.0;                       ///< of the body against the marker set's
  double residual_m = 0.0;                 ///< rms of the markers from the body; 0: not told
  MarkerSet marker_set;                    ///< with this body's offsets
  std::vector<double> bone_residuals_m;    ///< by bone; 0: not told
  std::vector<double> marker_residuals_m;  ///< by marker; likewise
};

/// Reads a subject file and the marker set that it names. Fails with all that is wrong: another format, a marker or
/// bone that the marker set does not have or that is missing here.
Result<SubjectFile, Faults> load_subject(const std::filesystem::path& path);

/// Writes a subject file, exactly: reading it gives the same bits. The file is replaced as a whole or, when that fails,
/// not at all.
Status save_subject(const std::filesystem::path& path, const SubjectFile& subject);

/// Writes a marker set as load_marker_set reads it, with the path of its skeleton's file as seen from its folder.
Status save_marker_set(const std::filesystem::path& path, const MarkerSet& set,
                       const std::filesystem::path& skeleton_file);

}  // namespace mocap::settings
