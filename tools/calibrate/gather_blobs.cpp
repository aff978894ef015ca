#include "calibrate/gather_blobs.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <numbers>
#include <utility>

#include "base/log.h"
#include "calibrate/run_cameras.h"
#include "calibrate/standing.h"
#include "cameras/replay/replay_settings.h"
#include "settings/rig_file.h"

namespace mocap::calibrate {
namespace {

using take::BlobRecording;
using take::RecordedPicture;

constexpr const char* kHeldHint =
    "; if mocapd is running it holds the cameras: stop it, or set [record] blobs = \"take.blobs\" in its "
    "configuration, "
    "let it run meanwhile, and give --blobs take.blobs";

/// One camera's blobs as they come, on its own thread.
class Collector {
 public:
  Collector(CameraModel& model, BlobWriter* writer, std::mutex& writing)
      : model_(model), writer_(writer), writing_(writing) {}

  Result<Wish> take(const Frame& frame, const runtime::CameraParts& parts) {
    if (detector_ == nullptr) {
      if (const Status prepared = prepare(frame.image, parts); !prepared) return prepared.error();
    }
    if (frame.image.width_px != width_px_ || frame.image.height_px != height_px_)
      return Error{ErrorCode::Io, fmt::format("camera '{}': sent an image of another size", model_.name)};
    const Blobs& blobs = detector_->detect(frame.image).blobs;
    RecordedPicture picture{frame.number, frame.exposed_at, {blobs.begin(), blobs.end()}};
    if (writer_ != nullptr) {
      if (const Status written = write(frame, blobs); !written) return written.error();
    }
    const std::lock_guard lock(mutex_);
    if (pictures_.empty() || picture.exposed_at > last_at_) {
      last_at_ = picture.exposed_at;
      pictures_.push_back(std::move(picture));
    }
    return enough ? Wish::Enough : Wish::More;
  }

  bool ready() const { return ready_.load(std::memory_order_acquire); }

  std::vector<RecordedPicture> what_came() {
    const std::lock_guard lock(mutex_);
    return std::exchange(pictures_, {});
  }

  std::atomic<bool> enough{false};

 private:
  Status prepare(const Image& image, const runtime::CameraParts& parts) {
    if (model_.width_px != 0 && (image.width_px != model_.width_px || image.height_px != model_.height_px)) {
      return Error{
          ErrorCode::InvalidArgument,
          fmt::format("camera '{}': images are {}x{} px, its lens is known for {}x{}; set the camera's size, or "
                      "make its lens file anew",
                      model_.name, image.width_px, image.height_px, model_.width_px, model_.height_px)};
    }
    Result<std::unique_ptr<Detector>> made = parts.make_detector(image);
    if (!made) return made.error();
    detector_ = std::move(*made);
    model_.width_px = width_px_ = image.width_px;
    model_.height_px = height_px_ = image.height_px;
    ready_.store(true, std::memory_order_release);
    return {};
  }

  Status write(const Frame& frame, const Blobs& blobs) {
    seen_.camera = frame.camera;
    seen_.number = frame.number;
    seen_.exposed_at = frame.exposed_at;
    seen_.blobs = blobs;
    const std::lock_guard lock(writing_);
    return writer_->write(seen_);
  }

  CameraModel& model_;
  BlobWriter* writer_;
  std::mutex& writing_;
  std::unique_ptr<Detector> detector_;
  int width_px_ = 0;
  int height_px_ = 0;
  std::atomic<bool> ready_{false};
  std::mutex mutex_;
  std::vector<RecordedPicture> pictures_;
  Timestamp last_at_;
  BlobFrame seen_;
};

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::InvalidArgument:
    case ErrorCode::Unsupported: return kExitData;
    default: return kExitUnavailable;
  }
}

Failure camera_failure(const Error& error) {
  const bool held = error.code == ErrorCode::Busy || error.code == ErrorCode::Timeout;
  const bool configured_wrongly = error.code == ErrorCode::InvalidArgument || error.code == ErrorCode::Unsupported;
  return {configured_wrongly ? kExitConfig : kExitUnavailable, error.message + (held ? kHeldHint : "")};
}

bool recorded(const settings::DaemonSettings& settings) {
  return std::ranges::all_of(settings.cameras, [](const cameras::CameraSettings& camera) {
    return camera.driver.as<cameras::ReplaySettings>() != nullptr;
  });
}

/// All cameras of a configuration.
class CameraTake {
 public:
  CameraTake(settings::DaemonSettings settings, const TakeOptions& options, const LookOn& look_on)
      : settings_(std::move(settings)), options_(options), look_on_(look_on) {
    gathered_.known = settings_.rig;
    gathered_.rig_file = settings_.capture.rig_file;
    gathered_.recording.pictures.resize(settings_.cameras.size());
    for (const auto& camera : settings_.cameras) gathered_.recording.cameras.push_back({camera.name, 0, 0});
  }

  Result<Gathered, Failure> run() {
    std::unique_ptr<BlobWriter> writer;
    if (!options_.record.empty()) {
      auto made = take::make_blob_writer(options_.record, gathered_.recording.cameras);
      if (!made) return Failure{kExitUnavailable, made.error().message};
      writer = std::move(*made);
    }
    for (CameraModel& camera : gathered_.known)
      collectors_.push_back(std::make_unique<Collector>(camera, writer.get(), writing_));
    std::vector<CameraRun> runs(collectors_.size());
    for (std::size_t i = 0; i < runs.size(); ++i) {
      runs[i].take = [&collector = *collectors_[i]](const Frame& frame, const runtime::CameraParts& parts) {
        return collector.take(frame, parts);
      };
    }
    const bool live = !recorded(settings_);
    run_cameras(settings_, runs, [&] {
      look(live, runs);
      return true;
    });
    end_progress();
    take_in();
    if (writer) {
      if (const Status finished = writer->finish(); !finished)
        return Failure{kExitUnavailable, finished.error().message};
    }
    for (const CameraRun& run : runs) {
      if (!run.end) return camera_failure(run.end.error());
    }
    name_sizes();
    return std::move(gathered_);
  }

 private:
  void look(bool live, const std::vector<CameraRun>& runs) {
    take_in();
    const bool all_ready = std::ranges::all_of(collectors_, [](const auto& one) { return one->ready(); });
    if (live && all_ready && began_at_ == Timestamp{}) began_at_ = host_now();
    const double seconds = began_at_ == Timestamp{} ? 0.0 : to_s(host_now() - began_at_);
    // A camera that failed ends the take: nothing can come of it.
    bool enough = ends_asked() > 0 || (live && seconds >= options_.seconds) ||
                  std::ranges::any_of(runs, [](const CameraRun& run) { return run.failed.load(); });
    if (all_ready) name_sizes();
    if (all_ready && look_on_) {
      const BlobRecording since = std::exchange(waiting_, {});
      enough = (!look_on_(gathered_, since, seconds) && live) || enough;
    }
    if (enough) {
      for (auto& collector : collectors_) collector->enough = true;
    }
  }

  void name_sizes() {
    for (std::size_t i = 0; i < gathered_.known.size(); ++i) {
      gathered_.recording.cameras[i].width_px = gathered_.known[i].width_px;
      gathered_.recording.cameras[i].height_px = gathered_.known[i].height_px;
    }
  }

  // Moves what came to the take; a copy waits for who looks on.
  void take_in() {
    waiting_.pictures.resize(collectors_.size());
    for (std::size_t i = 0; i < collectors_.size(); ++i) {
      auto came = collectors_[i]->what_came();
      waiting_.pictures[i].insert(waiting_.pictures[i].end(), came.begin(), came.end());
      auto& all = gathered_.recording.pictures[i];
      all.insert(all.end(), std::make_move_iterator(came.begin()), std::make_move_iterator(came.end()));
    }
  }

  settings::DaemonSettings settings_;
  const TakeOptions& options_;
  const LookOn& look_on_;
  Gathered gathered_;
  BlobRecording waiting_;
  std::mutex writing_;
  std::vector<std::unique_ptr<Collector>> collectors_;
  Timestamp began_at_;
};

Result<Gathered, Failure> from_file(const TakeOptions& options) {
  auto recording = take::read_blob_recording(options.blobs);
  if (!recording) return Failure{exit_code_of(recording.error().code), recording.error().message};
  if (recording->cut_off) say("{}: cut off; what is whole of it is used", options.blobs.string());
  Gathered gathered;
  for (const take::RecordedCamera& camera : recording->cameras) {
    CameraModel& model = gathered.known.emplace_back();
    model.name = camera.name;
    model.width_px = camera.width_px;
    model.height_px = camera.height_px;
  }
  gathered.recording = options.seconds > 0.0 ? last_of(*recording, options.seconds) : std::move(*recording);
  return gathered;
}

Lens about(const UnknownLens& unknown, int width_px, int height_px) {
  const double half_rad = 0.5 * unknown.fov_deg * std::numbers::pi / 180.0;
  Lens lens;
  lens.kind = unknown.kind;
  lens.fx_px = 0.5 * width_px / (unknown.kind == LensKind::Fisheye ? half_rad : std::tan(half_rad));
  lens.fy_px = lens.fx_px;
  lens.cx_px = 0.5 * (width_px - 1);
  lens.cy_px = 0.5 * (height_px - 1);
  return lens;
}

}  // namespace

void add_take_options(cli::App& command, TakeOptions& options) {
  auto* config = command.add_option("--config", options.config, "the daemon's configuration: its cameras are run")
                     ->type_name("FILE");
  auto* blobs = command.add_option("--blobs", options.blobs, "a blob recording instead of cameras")
                    ->type_name("FILE")
                    ->excludes(config);
  command.add_option("--record", options.record, "keeps what the cameras see as a blob recording")
      ->type_name("FILE.blobs")
      ->excludes(blobs);
}

Result<Gathered, Failure> gather_blobs(const TakeOptions& options, const LookOn& look_on) {
  if (options.config.empty() == options.blobs.empty())
    return Failure{kExitUsage, "say where the take comes from: --config FILE (cameras), or --blobs FILE (a recording)"};
  if (!options.blobs.empty()) return from_file(options);
  auto settings = settings::load_daemon_settings(options.config, settings::RigNeed::AsFound);
  if (!settings) return Failure{kExitConfig, settings::to_text(settings.error())};
  set_log_level(LogLevel::Warn);
  return CameraTake(std::move(*settings), options, look_on).run();
}

std::vector<calibration::Picture> pictures_of(const std::vector<RecordedPicture>& recorded) {
  std::vector<calibration::Picture> pictures;
  pictures.reserve(recorded.size());
  for (const RecordedPicture& one : recorded) {
    calibration::Picture& picture = pictures.emplace_back();
    picture.exposed_at = one.exposed_at;
    for (const Blob& blob : one.blobs) {
      if (!blob.touches_border && !blob.merged) picture.spots.push_back({blob.centroid, blob.sigma_px});
    }
  }
  return pictures;
}

calibration::Take take_of(const BlobRecording& recording) {
  calibration::Take take;
  for (const auto& pictures : recording.pictures) take.cameras.push_back(pictures_of(pictures));
  return take;
}

Result<Rig, Failure> with_lenses(const Gathered& gathered, const std::filesystem::path& lenses,
                                 const std::optional<UnknownLens>& unknown) {
  Rig given;
  if (!lenses.empty()) {
    auto loaded = settings::load_rig(lenses);
    if (!loaded) return Failure{kExitConfig, settings::to_text(loaded.error())};
    given = std::move(*loaded);
  }
  Rig rig = gathered.known;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    CameraModel& camera = rig[c];
    const take::RecordedCamera& seen = gathered.recording.cameras[c];
    const auto found = std::ranges::find(given, camera.name, &CameraModel::name);
    if (found != given.end()) camera = *found;
    if (seen.width_px != 0 && camera.width_px != 0 &&
        (seen.width_px != camera.width_px || seen.height_px != camera.height_px)) {
      return Failure{kExitData,
                     fmt::format("camera '{}': its images are {}x{} px, its lens file is for {}x{}; give the "
                                 "lens file of the size that is captured",
                                 camera.name, seen.width_px, seen.height_px, camera.width_px, camera.height_px)};
    }
    if (camera.width_px == 0) camera.width_px = seen.width_px, camera.height_px = seen.height_px;
    if (unknown && camera.width_px > 0) camera.lens = about(*unknown, camera.width_px, camera.height_px);
    if (camera.lens.fx_px <= 1.0 || camera.width_px == 0) {
      return Failure{kExitConfig,
                     fmt::format("camera '{}': its lens is not known{}; give a rig or lens file with --rig, or say how "
                                 "wide all cameras look with --fov DEGREES",
                                 camera.name, lenses.empty() ? "" : fmt::format(" of '{}'", lenses.string()))};
    }
  }
  return rig;
}

}  // namespace mocap::calibrate
