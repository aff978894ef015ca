#include "calibrate/gather_blobs.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <utility>

#include "base/log.h"
#include "calibrate/rig_deviations.h"
#include "calibrate/run_cameras.h"
#include "cameras/replay/replay_settings.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {
namespace {

using take::BlobRecording;
using take::RecordedPicture;

constexpr const char* kBusyHint =
    "; if mocapd is running it holds the cameras: stop it, or record a take (mocapctl take start) and calibrate with "
    "[[camera]] of driver = \"replay\", file = \"take.mcap\"";

/// The recording of the blobs of all cameras, if there is one. Its first failure ends the recording, not the cameras.
class Recorder {
 public:
  explicit Recorder(std::unique_ptr<BlobWriter> writer) : writer_(std::move(writer)) {}

  void write(const BlobFrame& frame) {
    const std::lock_guard lock(mutex_);
    if (writer_ != nullptr && written_) written_ = writer_->write(frame);
  }

  /// Ends the recording; fails if it is incomplete.
  Status finish() {
    const std::lock_guard lock(mutex_);
    return writer_ == nullptr || !written_ ? written_ : writer_->finish();
  }

 private:
  std::mutex mutex_;
  std::unique_ptr<BlobWriter> writer_;
  Status written_;
};

/// Detects the blobs of one camera on the camera's thread and hands them to the main thread.
class Collector {
 public:
  Collector(CameraModel& model, Recorder& recorder) : model_(model), recorder_(recorder) {}

  Result<RunState> take(const Frame& frame, const runtime::CameraParts& parts) {
    if (detector_ == nullptr) {
      if (const Status prepared = prepare(frame.image, parts); !prepared) return prepared.error();
    }
    if (frame.image.width_px != width_px_ || frame.image.height_px != height_px_)
      return Error{ErrorCode::Io, fmt::format("camera '{}': the image size changed", model_.name)};
    const Blobs& blobs = detector_->detect(frame.image).blobs;
    RecordedPicture image{frame.number, frame.exposed_at, {blobs.begin(), blobs.end()}};
    record(frame, blobs);
    const std::lock_guard lock(mutex_);
    if (pictures_.empty() || image.exposed_at > last_at_) {
      last_at_ = image.exposed_at;
      pictures_.push_back(std::move(image));
    }
    return stop ? RunState::Finished : RunState::Continue;
  }

  bool is_ready() const { return is_ready_.load(std::memory_order_acquire); }

  std::vector<RecordedPicture> take_images() {
    const std::lock_guard lock(mutex_);
    return std::exchange(pictures_, {});
  }

  std::atomic<bool> stop{false};

 private:
  Status prepare(const Image& image, const runtime::CameraParts& parts) {
    if (model_.width_px != 0 && (image.width_px != model_.width_px || image.height_px != model_.height_px)) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("camera '{}': images are {}x{} px, its lens was calibrated at {}x{}; set the image size of the "
                      "camera, or calibrate its lens again",
                      model_.name, image.width_px, image.height_px, model_.width_px, model_.height_px)};
    }
    Result<std::unique_ptr<Detector>> made = parts.make_detector(image);
    if (!made) return made.error();
    detector_ = std::move(*made);
    model_.width_px = width_px_ = image.width_px;
    model_.height_px = height_px_ = image.height_px;
    is_ready_.store(true, std::memory_order_release);
    return {};
  }

  void record(const Frame& frame, const Blobs& blobs) {
    seen_.camera = frame.camera;
    seen_.number = frame.number;
    seen_.exposed_at = frame.exposed_at;
    seen_.blobs = blobs;
    recorder_.write(seen_);
  }

  CameraModel& model_;
  Recorder& recorder_;
  std::unique_ptr<Detector> detector_;
  int width_px_ = 0;
  int height_px_ = 0;
  std::atomic<bool> is_ready_{false};
  std::mutex mutex_;
  std::vector<RecordedPicture> pictures_;
  Timestamp last_at_;
  BlobFrame seen_;
};

// Of a recording that cannot be read.
int exit_code_for(ErrorCode code) {
  switch (code) {
    case ErrorCode::InvalidArgument:
    case ErrorCode::Unsupported: return kExitData;
    default: return kExitNoInput;
  }
}

Failure failure_of_camera(const Error& error) {
  const bool is_busy = error.code == ErrorCode::Busy || error.code == ErrorCode::Timeout;
  const bool is_configuration_error = error.code == ErrorCode::InvalidArgument || error.code == ErrorCode::Unsupported;
  return {is_configuration_error ? kExitConfig : kExitUnavailable, error.message + (is_busy ? kBusyHint : "")};
}

bool is_replay(const settings::DaemonSettings& settings) {
  return std::ranges::all_of(settings.cameras, [](const cameras::CameraSettings& camera) {
    return camera.driver.as<cameras::ReplaySettings>() != nullptr;
  });
}

/// Records blobs from all cameras of a configuration.
class CameraRecorder {
 public:
  CameraRecorder(settings::DaemonSettings settings, const RecordingOptions& options, const RecordingObserver& observe)
      : settings_(std::move(settings)), options_(options), observe_(observe) {
    gathered_.known = settings_.rig;
    gathered_.rig_file = settings_.capture.rig_file;
    gathered_.recording.pictures.resize(settings_.cameras.size());
    for (const auto& camera : settings_.cameras) gathered_.recording.cameras.push_back({camera.name, 0, 0});
  }

  Result<GatheredBlobs, Failure> run() {
    std::unique_ptr<BlobWriter> writer;
    if (!options_.record.empty()) {
      auto made = take::make_blob_writer(options_.record, gathered_.recording.cameras);
      if (!made) {
        const bool is_bad_name = made.error().code == ErrorCode::InvalidArgument;
        return Failure{is_bad_name ? kExitUsage : kExitCannotWrite, made.error().message};
      }
      writer = std::move(*made);
      if (writer->path() != options_.record) {
        log_warn("record",
                 fmt::format("writes to '{}', because '{}' exists", writer->path(), options_.record.string()));
      }
    }
    Recorder recorder(std::move(writer));
    for (CameraModel& camera : gathered_.known) collectors_.push_back(std::make_unique<Collector>(camera, recorder));
    std::vector<CameraRun> runs(collectors_.size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
      runs[i].handle = [&collector = *collectors_[i]](const Frame& frame, const runtime::CameraParts& parts) {
        return collector.take(frame, parts);
      };
    }
    const bool live = !is_replay(settings_);
    run_cameras(settings_, runs, [&] {
      update(live, runs);
      return true;
    });
    clear_progress();
    collect();
    gathered_.recorded = recorder.finish();
    if (!gathered_.recorded)
      print_message("{}; the recording is incomplete, and all blobs are used", gathered_.recorded.error().message);
    for (const CameraRun& run : runs) {
      if (!run.end) return failure_of_camera(run.end.error());
    }
    update_image_sizes();
    return std::move(gathered_);
  }

 private:
  void update(bool live, const std::vector<CameraRun>& runs) {
    collect();
    const bool all_ready = std::ranges::all_of(collectors_, [](const auto& one) { return one->is_ready(); });
    if (live && all_ready && started_at_ == Timestamp{}) started_at_ = host_now();
    const double seconds = started_at_ == Timestamp{} ? 0.0 : to_s(host_now() - started_at_);
    // A failed camera ends the recording.
    bool stop = stop_requests() > 0 || (live && seconds >= options_.seconds) ||
                std::ranges::any_of(runs, [](const CameraRun& run) { return run.failed.load(); });
    if (all_ready) update_image_sizes();
    if (all_ready && observe_) {
      const BlobRecording since = std::exchange(unobserved_, {});
      stop = (!observe_(gathered_, since, seconds) && live) || stop;
    }
    if (stop) {
      for (auto& collector : collectors_) collector->stop = true;
    }
  }

  void update_image_sizes() {
    for (std::size_t i = 0; i < gathered_.known.size(); ++i) {
      gathered_.recording.cameras[i].width_px = gathered_.known[i].width_px;
      gathered_.recording.cameras[i].height_px = gathered_.known[i].height_px;
    }
  }

  // Moves new images into the recording, and copies them for the observer.
  void collect() {
    unobserved_.pictures.resize(collectors_.size());
    for (std::size_t i = 0; i < collectors_.size(); ++i) {
      auto images = collectors_[i]->take_images();
      unobserved_.pictures[i].insert(unobserved_.pictures[i].end(), images.begin(), images.end());
      auto& all = gathered_.recording.pictures[i];
      all.insert(all.end(), std::make_move_iterator(images.begin()), std::make_move_iterator(images.end()));
    }
  }

  settings::DaemonSettings settings_;
  const RecordingOptions& options_;
  const RecordingObserver& observe_;
  GatheredBlobs gathered_;
  BlobRecording unobserved_;
  std::vector<std::unique_ptr<Collector>> collectors_;
  Timestamp started_at_;
};

Result<GatheredBlobs, Failure> read_recording(const RecordingOptions& options) {
  auto recording = take::read_blob_recording(options.blobs);
  if (!recording) return Failure{exit_code_for(recording.error().code), recording.error().message};
  if (recording->cut_off)
    print_message("{}: the file is cut off; its complete images are used", options.blobs.string());
  GatheredBlobs gathered;
  for (const take::RecordedCamera& camera : recording->cameras) {
    CameraModel& model = gathered.known.emplace_back();
    model.name = camera.name;
    model.width_px = camera.width_px;
    model.height_px = camera.height_px;
  }
  gathered.recording = options.seconds > 0.0 ? last_of(*recording, options.seconds) : std::move(*recording);
  return gathered;
}

}  // namespace

void add_recording_options(cli::App& command, RecordingOptions& options) {
  auto* config = command.add_option("--config", options.config, "configuration of the daemon; runs its cameras")
                     ->type_name("FILE");
  auto* blobs = command.add_option("--blobs", options.blobs, "blob recording to read instead of running cameras")
                    ->type_name("FILE")
                    ->excludes(config);
  command
      .add_option("--record", options.record,
                  "write the blobs of the cameras to a blob recording; a file that exists is kept, and a number added "
                  "to the name")
      ->type_name("FILE.blobs")
      ->excludes(blobs);
}

Result<std::filesystem::path, Failure> configured_rig_file(const std::filesystem::path& config) {
  const auto settings = settings::load_daemon_settings(config, settings::RigNeed::AsFound);
  if (!settings) return Failure{kExitConfig, settings::to_text(settings.error())};
  return settings->capture.rig_file;
}

Result<GatheredBlobs, Failure> gather_blobs(const RecordingOptions& options, const RecordingObserver& observe) {
  if (options.config.empty() == options.blobs.empty())
    return Failure{kExitUsage, "set --config FILE (run cameras) or --blobs FILE (read a recording)"};
  if (!options.blobs.empty()) return read_recording(options);
  auto settings = settings::load_daemon_settings(options.config, settings::RigNeed::AsFound);
  if (!settings) return Failure{kExitConfig, settings::to_text(settings.error())};
  set_log_level(LogLevel::Warn);
  return CameraRecorder(std::move(*settings), options, observe).run();
}

int work_on_blobs(const Result<GatheredBlobs, Failure>& gathered,
                  const std::function<int(const GatheredBlobs&)>& work) {
  if (!gathered) {
    print_message("{}", gathered.error().message);
    return gathered.error().exit;
  }
  const int exit = work(*gathered);
  return exit == kExitOk && !gathered->recorded ? kExitCannotWrite : exit;
}

Result<Rig, Failure> rig_with_lenses(const GatheredBlobs& gathered, const std::filesystem::path& lenses,
                                     const std::optional<calibration::ApproximateLens>& unknown) {
  Rig loaded_rig;
  if (!lenses.empty()) {
    auto loaded = settings::load_rig(lenses);
    if (!loaded) return Failure{kExitConfig, settings::to_text(loaded.error())};
    loaded_rig = std::move(*loaded);
  }
  Rig rig = gathered.known;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    CameraModel& camera = rig[c];
    const take::RecordedCamera& seen = gathered.recording.cameras[c];
    const auto found = std::ranges::find(loaded_rig, camera.name, &CameraModel::name);
    if (found != loaded_rig.end()) camera = *found;
    if (seen.width_px != 0 && camera.width_px != 0 &&
        (seen.width_px != camera.width_px || seen.height_px != camera.height_px)) {
      return Failure{
          kExitData,
          fmt::format("camera '{}': its images are {}x{} px, its lens file is for {}x{}; use a lens file for "
                      "the captured image size",
                      camera.name, seen.width_px, seen.height_px, camera.width_px, camera.height_px)};
    }
    if (camera.width_px == 0) camera.width_px = seen.width_px, camera.height_px = seen.height_px;
    if (unknown && camera.width_px > 0 && calibration::takes_field_of_view(camera))
      camera.lens = calibration::lens_of(*unknown, camera.width_px, camera.height_px);
    if (camera.lens.fx_px <= 1.0 || camera.width_px == 0) {
      return Failure{kExitConfig,
                     fmt::format("camera '{}': its lens is unknown{}; set a rig or lens file with --rig, or the "
                                 "horizontal field of view of such cameras with --fov DEGREES",
                                 camera.name, lenses.empty() ? "" : fmt::format(" in '{}'", lenses.string()))};
    }
  }
  return rig;
}

}  // namespace mocap::calibrate
