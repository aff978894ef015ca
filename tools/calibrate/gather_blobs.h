#pragma once

#include <filesystem>
#include <functional>
#include <optional>

#include "calibrate/say.h"
#include "calibration/wand/wand_recording.h"
#include "lib/cli/app.h"
#include "model/camera_model.h"
#include "settings/daemon_settings.h"
#include "take/blob_recording.h"

namespace mocap::calibrate {

/// Where a take comes from: the cameras of a configuration, or a blob recording.
struct TakeOptions {
  std::filesystem::path config;
  std::filesystem::path blobs;
  std::filesystem::path record;  ///< keeps what the cameras saw; empty: not kept
  double seconds = 0.0;          ///< of live cameras, at most; of a recording the last; 0: all of it
};

void add_take_options(cli::App& command, TakeOptions& options);

/// What cameras saw.
struct Gathered {
  take::BlobRecording recording;
  Rig known;  ///< by camera: as the configuration's rig has it, or a name and the images' size alone
  std::filesystem::path rig_file;  ///< the configuration's; empty where there is none
};

/// Looks on while cameras are run, about ten times a second: all that came (and the sizes of all cameras' images), and
/// what of it is new, by camera. False: it is enough.
using LookOn = std::function<bool(const Gathered& so_far, const take::BlobRecording& since, double seconds)>;

/// Runs the cameras until `look_on` has enough, `seconds` are over or somebody ends it (then what came counts); a
/// recorded camera to its end and as fast as it goes, a blob recording at once. Fails with what to do.
Result<Gathered, Failure> gather_blobs(const TakeOptions& options, const LookOn& look_on = {});

/// As calibration takes it: without blobs that are cut off by the image's border, or more than one marker.
std::vector<calibration::Picture> pictures_of(const std::vector<take::RecordedPicture>& recorded);
calibration::Take take_of(const take::BlobRecording& recording);

/// Lenses of which only their kind is known, and about how wide they look from side to side.
struct UnknownLens {
  double fov_deg = 60.0;
  LensKind kind = LensKind::Pinhole;
};

/// The cameras that were gathered with the lenses that are known of them: those of `lenses` (a rig file; empty: the
/// configuration's), or as `unknown` says. Fails with the camera that has none, and with one whose images are
/// of another size.
Result<Rig, Failure> with_lenses(const Gathered& gathered, const std::filesystem::path& lenses,
                                 const std::optional<UnknownLens>& unknown);

}  // namespace mocap::calibrate
