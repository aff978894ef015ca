#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/calibration/calibration_report.h"
#include "settings/daemon_settings.h"

namespace mocap::settings {

/// The places of the rig of a running daemon, or of a rig file that a program replaces. Every rig is kept in the folder
/// `rigs` under the time of its calibration; no file there is ever changed or removed.
struct RigPlaces {
  std::filesystem::path in_force;  ///< the rig file that was read; may not exist
  std::filesystem::path written;   ///< the rig file that is written: in the state folder, without one the same file
  std::filesystem::path kept;      ///< folder of all rigs
};

/// Fails with InvalidArgument if there is no state folder and the configuration names no rig file.
Result<RigPlaces> rig_places(const DaemonSettings& settings);

/// Copies the rig in force to the kept ones, unless it is there already. Returns the path of the copy; an empty path if
/// there is no rig file. Fails with Io.
Result<std::filesystem::path> keep_rig_in_force(const RigPlaces& places);

/// Writes a rig to the kept ones only, under the time of the call. Returns the path. Fails with Io.
Result<std::filesystem::path> keep_rig(const RigPlaces& places, const CalibratedRig& rig);

/// Keeps the rig in force, writes the new one and its kept copy. Fails with Io.
Status write_rig(const RigPlaces& places, const CalibratedRig& rig);

/// Keeps the rig in force, and writes a kept one in its place. Fails with NotFound, Io or, if the kept file has faults,
/// InvalidArgument.
Status restore_rig(const RigPlaces& places, const std::string& name);

/// The bytes of the file `written`; nothing if there is none. Taken before write_rig or restore_rig, for undo_rig.
/// Fails with Io.
Result<std::optional<std::string>> written_rig(const RigPlaces& places);

/// Puts the bytes back, because the configuration with the new rig has faults. The new rig is kept. Fails with Io.
Status undo_rig(const RigPlaces& places, const std::optional<std::string>& bytes);

/// The kept rigs, the newest first, at most 200.
std::vector<KeptRig> list_rigs(const RigPlaces& places);

}  // namespace mocap::settings
