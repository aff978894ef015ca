#include "calibrate/mask_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "calibrate/run_cameras.h"
#include "calibrate/say.h"
#include "detect/blob_detector.h"
#include "settings/learnt_masks.h"
#include "settings/rig_file.h"

namespace mocap::calibrate {
namespace {

// Fewer tell a lamp from a marker that stands for a moment no more.
constexpr std::size_t kLeastFrames = 10;

/// Learns one camera's mask from its images.
class Learner {
 public:
  Learner(const CameraModel& model, detect::DetectSettings detect, std::size_t frames)
      : model_(model), detect_(detect), frames_(frames) {}

  Result<Wish> take(const Image& image) {
    if (!learner_) {
      if (image.width_px != model_.width_px || image.height_px != model_.height_px) {
        return Error{ErrorCode::InvalidArgument,
                     fmt::format("camera '{}': images are {}x{}, the rig was made at {}x{}", model_.name,
                                 image.width_px, image.height_px, model_.width_px, model_.height_px)};
      }
      auto made = detect::make_blob_detector(detect_, image.format, image.width_px, image.height_px);
      if (!made) return made.error();
      detector_ = std::move(*made);
      learner_.emplace(image.width_px, image.height_px, model_.masks);
    }
    // What the daemon will take for bright: also where it finds the threshold in each image.
    threshold_grey_ = detector_->detect(image).threshold_grey;
    if (!learner_->add(image, threshold_grey_)) {
      return Error{ErrorCode::Io, fmt::format("camera '{}': sent an image of another size or format", model_.name)};
    }
    return learner_->images() < frames_ ? Wish::More : Wish::Enough;
  }

  std::size_t images() const { return learner_ ? learner_->images() : 0; }
  double threshold_grey() const { return threshold_grey_; }
  const CameraModel& model() const { return model_; }
  detect::LearntMask learn(const detect::LearnMaskSettings& settings) const { return learner_->learn(settings); }

 private:
  const CameraModel& model_;
  detect::DetectSettings detect_;
  std::size_t frames_;
  std::unique_ptr<Detector> detector_;
  std::optional<detect::MaskLearner> learner_;
  double threshold_grey_ = 0.0;
};

// The rig's entries of the configured cameras, by CameraId; what --rig names stands in for the configuration's.
bool take_rig(const MaskOptions& options, settings::DaemonSettings& settings) {
  if (options.rig.empty()) return true;
  const auto rig = settings::load_rig(options.rig);
  if (!rig) {
    fmt::print(stderr, "{}\n", settings::to_text(rig.error()));
    return false;
  }
  for (CameraModel& camera : settings.rig) {
    const auto found = std::ranges::find(*rig, camera.name, &CameraModel::name);
    if (found == rig->end()) {
      say("camera '{}' is not in the rig {}", camera.name, options.rig.string());
      return false;
    }
    camera = *found;
  }
  return true;
}

int exit_code_of(ErrorCode code) {
  return code == ErrorCode::InvalidArgument || code == ErrorCode::Unsupported ? kExitConfig : kExitUnavailable;
}

bool tell_progress(const std::vector<CameraRun>& runs, std::size_t frames) {
  std::size_t done = 0;
  for (const CameraRun& run : runs) done += std::min(run.images.load(std::memory_order_relaxed), frames);
  show_progress(done >= frames * runs.size() ? "" : fmt::format("{} of {} images", done, frames * runs.size()));
  return ends_asked() == 0;
}

int gather(const settings::DaemonSettings& settings, std::vector<Learner>& learners, std::size_t frames) {
  std::vector<CameraRun> runs(learners.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].take = [&learner = learners[i]](const Frame& frame, const runtime::CameraParts&) {
      return learner.take(frame.image);
    };
  }
  run_cameras(settings, runs, [&] { return tell_progress(runs, frames); });
  int exit = kExitOk;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].end) {
      say("{}", runs[i].end.error().message);
      exit = exit_code_of(runs[i].end.error().code);
    } else if (learners[i].images() < kLeastFrames) {
      say("camera '{}': only {} images came, expected {} at least", learners[i].model().name, learners[i].images(),
          kLeastFrames);
      exit = kExitData;
    }
  }
  return exit;
}

// Says what was found; whether it may be written.
bool tell(const Learner& learner, const detect::LearntMask& learnt, const MaskOptions& options) {
  const std::string& name = learner.model().name;
  const std::string seen = learnt.lights == 0
                               ? "nothing shines, no mask"
                               : fmt::format("{} lights, {} polygons", learnt.lights, learnt.polygons.size());
  fmt::print("camera {}: {}, {:.2f} % of the image masked (images={} threshold={:.0f}grey)\n", name, seen,
             100.0 * learnt.covered_share, learner.images(), learner.threshold_grey());
  std::fflush(stdout);
  if (learnt.moved > 0) {
    say("camera {}: {} bright spots moved, or came and went, and are not masked; is the volume empty? Run it again "
        "when "
        "nobody is there",
        name, learnt.moved);
  }
  if (100.0 * learnt.covered_share <= options.most_percent) return true;
  say("camera {}: {:.1f} % of the image would be masked, expected {:.1f} % at most; shade what shines, lower exposure "
      "or "
      "gain, raise its threshold, or say --most-percent",
      name, 100.0 * learnt.covered_share, options.most_percent);
  return false;
}

int write(const MaskOptions& options, const std::filesystem::path& path, const Rig& rig) {
  if (options.dry_run) {
    fmt::print("{} is as it was (--dry-run)\n", path.string());
    return kExitOk;
  }
  const Status saved = settings::save_learnt_masks(path, rig);
  if (!saved) {
    say("{}", saved.error().message);
    return exit_code_of(saved.error().code);
  }
  fmt::print("{}: written; mocapd uses it when it is started again\n", path.string());
  return kExitOk;
}

}  // namespace

void add_mask_command(cli::App& app, MaskOptions& options) {
  cli::App* mask = app.add_subcommand("mask", "learn what shines in the empty volume, and mask it");
  mask->add_option("--config", options.config, "the daemon's configuration: its cameras are run")
      ->required()
      ->type_name("FILE");
  mask->add_option("--rig", options.rig, "the rig file to read and write; default: the configuration's")
      ->type_name("FILE");
  mask->add_option("--frames", options.frames, "images of each camera")
      ->check(cli::Range(kLeastFrames, std::size_t{100000}))
      ->capture_default_str();
  mask->add_option("--margin-px", options.learn.margin_px, "a mask reaches so far over what shines")
      ->check(cli::Range(0.0, 100.0))
      ->capture_default_str();
  mask->add_option("--least-share", options.learn.least_share, "of the images in which a light shines")
      ->check(cli::Range(0.01, 1.0))
      ->capture_default_str();
  mask->add_option("--most-percent", options.most_percent, "of an image that may be masked; more is refused")
      ->check(cli::Range(0.0, 100.0))
      ->capture_default_str();
  mask->add_flag("--dry-run", options.dry_run, "say what it would do, write nothing");
  mask->add_flag("--clear", options.clear, "forget all that was learnt; masks that you drew stay");
}

int run_mask(const MaskOptions& options) {
  Result<settings::DaemonSettings, settings::Faults> settings = settings::load_daemon_settings(options.config);
  if (!settings) {
    fmt::print(stderr, "{}\n", settings::to_text(settings.error()));
    return kExitConfig;
  }
  if (!take_rig(options, *settings)) return kExitConfig;
  set_log_level(LogLevel::Warn);
  const std::filesystem::path path = options.rig.empty() ? settings->capture.rig_file : options.rig;
  Rig learnt_rig = settings->rig;
  for (CameraModel& camera : learnt_rig) camera.learnt_masks.clear();
  if (options.clear) return write(options, path, learnt_rig);

  catch_end();
  std::vector<Learner> learners;
  for (std::uint32_t i = 0; i < settings->cameras.size(); ++i) {
    learners.emplace_back(settings->rig[i], settings::detect_of(*settings, CameraId{i}), options.frames);
  }
  say("looking at {} cameras, {} images each; nobody and no marker should be in the volume", learners.size(),
      options.frames);
  if (const int failed = gather(*settings, learners, options.frames); failed != kExitOk) {
    say("{} is as it was", path.string());
    return failed;
  }
  bool may_be_written = true;
  for (std::size_t i = 0; i < learners.size(); ++i) {
    const detect::LearntMask learnt = learners[i].learn(options.learn);
    may_be_written = tell(learners[i], learnt, options) && may_be_written;
    learnt_rig[i].learnt_masks = learnt.polygons;
  }
  if (may_be_written) return write(options, path, learnt_rig);
  say("{} is as it was", path.string());
  return kExitData;
}

}  // namespace mocap::calibrate
