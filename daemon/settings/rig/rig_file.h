#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "model/calibration/calibration_report.h"
#include "model/camera_model.h"
#include "settings/faults.h"

namespace mocap::settings {

/// The table [metadata] of a rig file: for people and tools, no part of the rig.
using RigMetadata = RigFacts;

/// Reads the cameras of a rig file, in the order of the file.
///
/// The layout is the one that Pose2Sim and aniposelib read and write: a table per camera with `name`, `size` = [width,
/// height], `matrix` (3x3), `distortions` (OpenCV's k1 k2 p1 p2 [k3], or k1 k2 k3 k4 of a fisheye), `rotation`
/// (Rodrigues vector, or a 3x3 matrix; camera from world), `translation` (m), `fisheye`, `lens_from_fov` (only if true:
/// Lens::is_from_fov). Fails with all faults, such as
/// a camera that occurs twice, a matrix that is no camera matrix or no rotation, a focal length that is not positive,
/// or a number that is not finite.
Result<Rig, Faults> load_rig(const std::filesystem::path& path);

/// Whether the metadata of a rig file says that its world frame is provisional, because no floor was ever measured:
/// `floor = "guessed"`. False without a file.
bool floor_is_guessed(const std::filesystem::path& path);

/// A rig file of another program.
struct ForeignRig {
  Rig rig;
  std::vector<std::string> left_out;  ///< a sentence for each table or key that was left out
};

/// As load_rig, but unknown keys, and tables that are no camera, are left out and listed.
Result<ForeignRig, Faults> load_foreign_rig(const std::filesystem::path& path);

/// Writes a rig file as above; reading it gives the same cameras to 1e-12. The file is replaced as a whole or, if that
/// fails, not at all. Fails with Io, and with InvalidArgument if a camera is named kRigMetadata.
Status save_rig(const std::filesystem::path& path, const Rig& rig, const RigMetadata& metadata);

}  // namespace mocap::settings
