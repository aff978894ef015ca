#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "calibrate/terminal.h"
#include "calibration/rig/approximate_lens.h"
#include "lib/cli/app.h"
#include "model/camera_model.h"
#include "settings/daemon_settings.h"
#include "take/recordings/blob_recording.h"

namespace mocap::calibrate {

/// The source of a recording: the cameras of a configuration, or a blob recording.
struct RecordingOptions {
  std::filesystem::path config;
  std::filesystem::path blobs;
  std::filesystem::path record;  ///< blob recording to write; empty: none
  double seconds = 0.0;          ///< largest duration of live cameras; the last part of a recording; 0: no limit
};

void add_recording_options(cli::App& command, RecordingOptions& options);

/// The blobs of all cameras.
struct GatheredBlobs {
  take::BlobRecording recording;
  Rig known;                       ///< the cameras of the configuration's rig; without a rig, name and image size only
  std::filesystem::path rig_file;  ///< of the configuration; empty: none
  Status recorded;                 ///< a failure if RecordingOptions::record is incomplete; the blobs are complete
};

/// The rig file of a configuration, `[capture] rig`; empty: none. Fails with kExitConfig.
Result<std::filesystem::path, Failure> configured_rig_file(const std::filesystem::path& config);

/// Called about ten times a second while cameras run: with all blobs so far, the new ones, and the elapsed time.
/// Returning false ends the recording.
using RecordingObserver =
    std::function<bool(const GatheredBlobs& so_far, const take::BlobRecording& since, double seconds)>;

/// Runs the cameras until `observe` returns false, `seconds` are over, or the operator stops the program (the blobs so
/// far are then returned). A recording that cannot be written is reported, and costs no blobs. Replay cameras run to
/// their end at full speed; a blob recording is read at once. Fails with an advice.
Result<GatheredBlobs, Failure> gather_blobs(const RecordingOptions& options, const RecordingObserver& observe = {});

/// The exit code of a command whose `work` on the blobs returns its exit code: that one, kExitCannotWrite if only the
/// recording failed, or that of the failure to gather, which is printed.
int work_on_blobs(const Result<GatheredBlobs, Failure>& gathered, const std::function<int(const GatheredBlobs&)>& work);

/// The cameras of a recording with their lenses: those of `lenses` (a rig file; empty: the configuration's), or those
/// of `unknown` for which takes_field_of_view. Fails for a camera without a lens, or with another image size than its
/// lens.
Result<Rig, Failure> rig_with_lenses(const GatheredBlobs& gathered, const std::filesystem::path& lenses,
                                     const std::optional<calibration::ApproximateLens>& unknown);

}  // namespace mocap::calibrate
