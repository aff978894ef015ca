#include "cameras/replay/replay_camera.h"

#include <fmt/format.h>

#include <thread>
#include <utility>

#include "base/log.h"
#include "cameras/replay/image_file.h"
#include "cameras/replay/replay_recording.h"
#include "cameras/replay/video_file.h"

namespace mocap::cameras {
namespace {

class ReplayCamera : public Camera {
 public:
  ReplayCamera(CameraId id, std::string name, ReplaySettings settings)
      : id_(id), name_(std::move(name)), settings_(std::move(settings)) {}

  Status start() override;
  Result<Frame> next(Duration patience) override;
  void stop() noexcept override { started_ = false; }

 private:
  Status open();
  Result<RecordedFrame> upcoming();
  bool wait_until_due(const RecordedFrame& frame, Duration patience);
  Status load(const RecordedFrame& frame);
  Status rewind();
  Error error(ErrorCode code, const std::string& what) const {
    return {code, fmt::format("camera '{}': {}", name_, what)};
  }

  CameraId id_;
  std::string name_;
  ReplaySettings settings_;

  Recording recording_;
  std::unique_ptr<VideoFile> video_;
  GreyImage image_;  // lent until the next call
  bool started_ = false;
  std::size_t next_ = 0;  // index of the next frame
  std::uint64_t pass_number_ = 0;
  Duration pass_time_{};  // added to the recorded times in this pass
  bool paced_ = false;
  Timestamp first_due_;      // time of the first frame on the host's clock
  Timestamp first_exposed_;  // recorded time of the first frame
  RecordedFrame last_;
};

Status ReplayCamera::start() {
  stop();
  if (Status opened = open(); !opened) return opened;
  next_ = 0;
  pass_number_ = 0;
  pass_time_ = Duration::zero();
  paced_ = false;
  started_ = true;
  log_info("camera " + name_,
           fmt::format("started driver=replay folder={} speed={}", settings_.folder.string(), settings_.speed));
  return {};
}

Status ReplayCamera::open() {
  if (!(settings_.rate_hz > 0.0) || !(settings_.speed >= 0.0)) {
    return error(ErrorCode::InvalidArgument,
                 fmt::format("rate_hz is {} and speed is {}, expected over 0 and at least 0", settings_.rate_hz,
                             settings_.speed));
  }
  Result<Recording> found = find_recording(settings_.folder, name_, settings_.rate_hz);
  if (!found) return error(found.error().code, found.error().message);
  recording_ = *std::move(found);
  return recording_.video.empty() ? Status{} : rewind();
}

Status ReplayCamera::rewind() {
  if (recording_.video.empty()) return {};
  video_.reset();
  Result<std::unique_ptr<VideoFile>> opened = open_video(recording_.video);
  if (!opened) return error(opened.error().code, opened.error().message);
  video_ = *std::move(opened);
  return {};
}

// The next frame with its number and time in this pass.
Result<RecordedFrame> ReplayCamera::upcoming() {
  const bool untimed_video = !recording_.video.empty() && recording_.frames.empty();
  if (!untimed_video && next_ == recording_.frames.size()) {
    return error(ErrorCode::EndOfStream, "the recording has ended");
  }
  RecordedFrame frame;
  if (untimed_video) {
    frame.number = next_;
    frame.exposed_at = Timestamp{from_s(static_cast<double>(next_) / settings_.rate_hz)};
  } else {
    frame = recording_.frames[next_];
  }
  frame.number += pass_number_;
  frame.exposed_at += pass_time_;
  return frame;
}

bool ReplayCamera::wait_until_due(const RecordedFrame& frame, Duration patience) {
  if (settings_.speed <= 0.0) return true;
  const Timestamp now = host_now();
  if (!std::exchange(paced_, true)) {
    first_due_ = now;
    first_exposed_ = frame.exposed_at;
  }
  const Timestamp due = first_due_ + from_s(to_s(frame.exposed_at - first_exposed_) / settings_.speed);
  if (due > now + patience) {
    std::this_thread::sleep_for(patience);
    return false;
  }
  std::this_thread::sleep_until(due);
  return true;
}

Status ReplayCamera::load(const RecordedFrame& frame) {
  Result<GreyImage> image = recording_.video.empty() ? read_grey_image(frame.file) : video_->next();
  if (image) {
    image_ = *std::move(image);
    return {};
  }
  if (image.error().code == ErrorCode::EndOfStream) return error(ErrorCode::EndOfStream, image.error().message);
  return error(ErrorCode::Io, recording_.video.empty()
                                  ? image.error().message
                                  : fmt::format("cannot read frame {}: {}", frame.number, image.error().message));
}

Result<Frame> ReplayCamera::next(Duration patience) {
  if (!started_) return error(ErrorCode::DeviceLost, "not started");
  Result<RecordedFrame> coming = upcoming();
  if (coming && !wait_until_due(*coming, patience)) return Error{ErrorCode::Timeout, {}};
  Status loaded = coming ? load(*coming) : Status{coming.error()};
  if (!loaded && loaded.error().code == ErrorCode::EndOfStream && settings_.loop && next_ > 0) {
    // The next pass begins one mean period after the last frame.
    const auto period = from_s(1.0 / settings_.rate_hz);
    const bool timed = recording_.frames.size() > 1;
    const Duration step = timed ? (recording_.frames.back().exposed_at - recording_.frames.front().exposed_at) /
                                      static_cast<std::int64_t>(recording_.frames.size() - 1)
                                : period;
    const RecordedFrame first = recording_.frames.empty() ? RecordedFrame{} : recording_.frames.front();
    pass_number_ = last_.number + 1 - first.number;
    pass_time_ = last_.exposed_at + step - first.exposed_at;
    next_ = 0;
    if (Status again = rewind(); !again) return again.error();
    return next(patience);
  }
  if (coming) last_ = *coming;
  if (!loaded) {
    if (loaded.error().code == ErrorCode::Io) ++next_;
    return loaded.error();
  }
  ++next_;
  Frame frame;
  frame.camera = id_;
  frame.number = coming->number;
  frame.exposed_at = coming->exposed_at;
  frame.received_at = coming->exposed_at;
  frame.image = {image_.pixels, static_cast<std::size_t>(image_.width_px), image_.width_px, image_.height_px,
                 PixelFormat::Mono8};
  return frame;
}

}  // namespace

std::unique_ptr<Camera> make_replay_camera(CameraId id, std::string name, ReplaySettings settings) {
  return std::make_unique<ReplayCamera>(id, std::move(name), std::move(settings));
}

Result<std::unique_ptr<Camera>> open_replay_camera(CameraId id, const std::string& name, const ReplaySettings& settings,
                                                   const CameraSurroundings& /*surroundings*/) {
  if (!settings.file.empty()) {
    return Error{ErrorCode::Unsupported,
                 fmt::format("camera '{}': '{}' is a take, which has blobs and no images; mocapd plays it", name,
                             settings.file.string())};
  }
  return make_replay_camera(id, name, settings);
}

}  // namespace mocap::cameras
