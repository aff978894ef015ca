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
#include "calibrate/rig_output.h"
#include "calibrate/run_cameras.h"
#include "calibrate/terminal.h"
#include "detect/blob_detector.h"
#include "settings/rig/rig_file.h"
#include "settings/rig/rig_masks.h"

namespace mocap::calibrate {
namespace {

// With fewer images, a stationary marker cannot be distinguished from a light. Chosen by hand; not yet measured.
constexpr std::size_t kMinFrames = 10;

/// Learns the mask of one camera from its images.
class Learner {
 public:
  Learner(const CameraModel& model, detect::DetectSettings detect, std::size_t frames)
      : model_(model), detect_(detect), frames_(frames) {}

  Result<RunState> handle(const Image& image) {
    if (!learner_) {
      const bool has_size = model_.width_px != 0;  // a camera that is not in the rig may have none
      if (has_size && (image.width_px != model_.width_px || image.height_px != model_.height_px)) {
        return Error{ErrorCode::InvalidArgument,
                     fmt::format("camera '{}': images are {}x{}, the rig was calibrated at {}x{}", model_.name,
                                 image.width_px, image.height_px, model_.width_px, model_.height_px)};
      }
      auto made = detect::make_blob_detector(detect_, image.format, image.width_px, image.height_px);
      if (!made) return made.error();
      detector_ = std::move(*made);
      learner_.emplace(image.width_px, image.height_px, model_.masks);
    }
    // The threshold of the daemon's detector, which may be automatic.
    threshold_grey_ = detector_->detect(image).threshold_grey;
    if (!learner_->add(image, threshold_grey_)) {
      return Error{ErrorCode::Io, fmt::format("camera '{}': the image size or format changed", model_.name)};
    }
    return learner_->images() < frames_ ? RunState::Continue : RunState::Finished;
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

// Replaces the configuration's rig entries by those of --rig.
bool use_rig(const MaskOptions& options, settings::DaemonSettings& settings) {
  if (options.rig.empty()) return true;
  const auto rig = settings::load_rig(options.rig);
  if (!rig) {
    fmt::print(stderr, "{}\n", settings::to_text(rig.error()));
    return false;
  }
  for (CameraModel& camera : settings.rig) {
    const auto found = std::ranges::find(*rig, camera.name, &CameraModel::name);
    if (found == rig->end()) {
      print_message("camera '{}' is not in the rig {}", camera.name, options.rig.string());
      return false;
    }
    camera = *found;
  }
  return true;
}

int exit_of_mask(ErrorCode code) {
  return code == ErrorCode::InvalidArgument || code == ErrorCode::Unsupported ? kExitConfig : kExitUnavailable;
}

bool report_progress(const std::vector<CameraRun>& runs, std::size_t frames) {
  std::size_t done = 0;
  for (const CameraRun& run : runs) done += std::min(run.images.load(std::memory_order_relaxed), frames);
  show_progress(done >= frames * runs.size() ? "" : fmt::format("{} of {} images", done, frames * runs.size()));
  return stop_requests() == 0;
}

int gather(const settings::DaemonSettings& settings, std::vector<Learner>& learners, std::size_t frames) {
  std::vector<CameraRun> runs(learners.size());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    runs[i].handle = [&learner = learners[i]](const Frame& frame, const runtime::CameraParts&) {
      return learner.handle(frame.image);
    };
  }
  run_cameras(settings, runs, [&] { return report_progress(runs, frames); });
  int exit = kExitOk;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].end) {
      print_message("{}", runs[i].end.error().message);
      exit = exit_of_mask(runs[i].end.error().code);
    } else if (learners[i].images() < kMinFrames) {
      print_message("camera '{}': only {} images arrived, expected at least {}", learners[i].model().name,
                    learners[i].images(), kMinFrames);
      exit = kExitData;
    }
  }
  return exit;
}

// Reports the learned mask; returns whether it may be written.
bool report(const Learner& learner, const detect::LearntMask& learnt, const MaskOptions& options) {
  const std::string& name = learner.model().name;
  const std::string seen = learnt.lights == 0
                               ? "no lights, no mask"
                               : fmt::format("{} lights, {} polygons", learnt.lights, learnt.polygons.size());
  fmt::print("camera {}: {}, {:.2f} % of the image masked (images={} threshold={:.0f}grey)\n", name, seen,
             100.0 * learnt.covered_share, learner.images(), learner.threshold_grey());
  std::fflush(stdout);
  if (learnt.moved > 0) {
    print_message(
        "camera {}: {} bright spots moved, or came and went, and are not masked; check that the volume is empty, and "
        "run "
        "it again",
        name, learnt.moved);
  }
  if (100.0 * learnt.covered_share <= options.most_percent) return true;
  print_message(
      "camera {}: {:.1f} % of the image would be masked, expected {:.1f} % at most; shade the lights, lower exposure "
      "or "
      "gain, raise the threshold, or set --most-percent",
      name, 100.0 * learnt.covered_share, options.most_percent);
  return false;
}

int write(const MaskOptions& options, const std::filesystem::path& path, const Rig& rig) {
  if (options.dry_run) {
    fmt::print("{}: unchanged (--dry-run)\n", path.string());
    return kExitOk;
  }
  const auto saved = settings::save_masks(path, rig, settings::kLearntMasks);
  if (!saved) {
    print_message("{}", saved.error().message);
    return saved.error().code == ErrorCode::Io ? kExitCannotWrite : exit_of_mask(saved.error().code);
  }
  if (!saved->empty()) print_message("{}", settings::no_place_for_masks(path, *saved));
  if (saved->size() < rig.size()) fmt::print("{}: written; restart mocapd to use it\n", path.string());
  return saved->empty() ? kExitOk : kExitConfig;
}

}  // namespace

void add_mask_command(cli::App& app, MaskOptions& options) {
  cli::App* mask = app.add_subcommand("mask", "learn the lights in the empty volume and mask them");
  mask->examples(
      "  mocap-calibrate mask --config my.toml\n"
      "  mocap-calibrate mask --config my.toml --dry-run\n"
      "  mocap-calibrate mask --config my.toml --clear");
  mask->add_option("--config", options.config, "configuration of the daemon; runs its cameras")
      ->required()
      ->type_name("FILE");
  mask->add_option("--rig", options.rig, "rig file to read and write; default: the configuration's")->type_name("FILE");
  mask->add_option("--frames", options.frames, "number of images of each camera")
      ->check(cli::Range(kMinFrames, std::size_t{100000}))
      ->capture_default_str();
  mask->add_option("--margin-px", options.learn.margin_px, "margin of a mask around a light")
      ->check(cli::Range(0.0, 100.0))
      ->capture_default_str();
  mask->add_option("--least-share", options.learn.least_share,
                   "smallest fraction of the images in which a light shines")
      ->check(cli::Range(0.01, 1.0))
      ->capture_default_str();
  mask->add_option("--most-percent", options.most_percent, "largest part of an image that may be masked")
      ->check(cli::Range(0.0, 100.0))
      ->capture_default_str();
  mask->add_flag("--dry-run", options.dry_run, "report only, write nothing");
  mask->add_flag("--clear", options.clear, "remove all learned masks; drawn masks stay");
}

int run_mask(const MaskOptions& options) {
  Result<settings::DaemonSettings, settings::Faults> settings = settings::load_daemon_settings(options.config);
  if (!settings) {
    fmt::print(stderr, "{}\n", settings::to_text(settings.error()));
    return kExitConfig;
  }
  if (!use_rig(options, *settings)) return kExitConfig;
  set_log_level(LogLevel::Warn);
  const std::filesystem::path path = options.rig.empty() ? settings->capture.rig_file : options.rig;
  Rig learnt_rig = settings->rig;
  for (CameraModel& camera : learnt_rig) camera.learnt_masks.clear();
  if (options.clear) return write(options, path, learnt_rig);
  const Status writable = options.dry_run ? Status() : check_writable(path);
  if (!writable) {
    print_message("{}", writable.error().message);
    return kExitCannotWrite;
  }

  catch_signals();
  std::vector<Learner> learners;
  for (std::uint32_t i = 0; i < settings->cameras.size(); ++i) {
    learners.emplace_back(settings->rig[i], settings::detect_of(*settings, CameraId{i}), options.frames);
  }
  print_message("running {} cameras, {} images each; the volume must be empty, without people and markers",
                learners.size(), options.frames);
  if (const int failed = gather(*settings, learners, options.frames); failed != kExitOk) {
    print_message("{}: unchanged", path.string());
    return failed;
  }
  bool may_be_written = true;
  for (std::size_t i = 0; i < learners.size(); ++i) {
    const detect::LearntMask learnt = learners[i].learn(options.learn);
    may_be_written = report(learners[i], learnt, options) && may_be_written;
    learnt_rig[i].learnt_masks = learnt.polygons;
  }
  if (may_be_written) return write(options, path, learnt_rig);
  print_message("{}: unchanged", path.string());
  return kExitData;
}

}  // namespace mocap::calibrate
