#pragma once

#include <filesystem>
#include <string>

#include "calibrate/gather_blobs.h"
#include "calibrate/rig_deviations.h"
#include "calibration/diagnosis/diagnose_rig.h"
#include "lib/cli/app.h"

namespace mocap::calibrate {

/// A sentence about a camera that was bumped during a recording.
std::string describe(const CameraBump& moved, const Rig& rig);

/// The cameras that do not fit the rig, other than by a motion that the drift watch has detected.
calibration::RigDiagnosis diagnose(const take::BlobRecording& recording, const Rig& rig,
                                   const RigDeviations& deviations);

/// Prints a sentence for each finding.
void print_findings(const calibration::RigDiagnosis& diagnosis, const Rig& rig);

/// Durations of `verify` and `refine` without --seconds: of live cameras, and the last part of a recording.
inline constexpr double kLiveSeconds = 10.0;
inline constexpr double kRecordedSeconds = 60.0;

struct VerifyOptions {
  RecordingOptions take;
  std::filesystem::path rig;  ///< empty: the configuration's
  double drift_px = 1.0;
};

/// Adds the subcommand `verify`.
void add_verify_command(cli::App& app, VerifyOptions& options);

/// Reports for each camera whether its pose agrees with the rig. Returns the exit code of the program: kExitData if a
/// camera deviates or does not fit, or if the deviation of a camera is undetermined.
int run_verify(const VerifyOptions& options);

struct RefineOptions {
  VerifyOptions verify;
  std::filesystem::path out;  ///< empty: the rig
  bool dry_run = false;
  int threads = 2;
};

/// Adds the subcommand `refine`.
void add_refine_command(cli::App& app, RefineOptions& options);

/// Repairs a rig from moving markers: first bumped cameras, then all. Returns the exit code of the program: kExitData
/// if nothing was repaired. A camera that could not be judged is kept as it was, with a warning.
int run_refine(const RefineOptions& options);

}  // namespace mocap::calibrate
