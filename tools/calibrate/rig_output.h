#pragma once

#include <filesystem>

#include "base/result.h"
#include "calibrate/terminal.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {

/// Whether a file can be written: its folder exists and is writable. Call it before work whose result would be lost.
/// Fails with Io.
Status check_writable(const std::filesystem::path& path);

/// The same of a rig that write_rig will write: to `out` or, if that is empty, to the rig file of the configuration
/// `config`. A rig that is replaced is kept, so its folder `rigs` must be writable, too. Fails with kExitUsage without
/// a file, with kExitConfig and kExitCannotWrite.
Result<void, Failure> check_rig_output(const std::filesystem::path& out, const std::filesystem::path& config);

/// Writes a rig file with `facts`, the subcommand and the time as its metadata, and reports it. A rig that is replaced
/// is kept in the folder `rigs` beside the file (settings/rig/kept_rigs.h).
///
/// Returns the exit code of the program: kExitCannotWrite if the file cannot be written; kExitData if `rig` is
/// no rig (settings::save_rig), or if the file is there and is no rig file, or has a camera that `rig` lacks: the file
/// is unchanged then, and the new rig is kept in `rigs`.
int write_rig(const std::filesystem::path& path, const Rig& rig, settings::RigMetadata facts, const char* subcommand);

/// Appends the cameras of a rig file that `rig` lacks because they are not in the recording, and reports them. For
/// commands after which the pose of such a camera is still known; `file` may be missing.
Rig with_absent_cameras(Rig rig, const std::filesystem::path& file);

}  // namespace mocap::calibrate
