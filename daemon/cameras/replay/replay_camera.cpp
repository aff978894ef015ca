#include "cameras/replay/replay_camera.h"

#include <fmt/format.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <thread>
#include <utility>

#include "base/log.h"
#include "cameras/replay/replay_recording.h"

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
  cv::VideoCapture video_;
  cv::Mat read_;   // as it stands in the video
  cv::Mat image_;  // grey: lent until the next call
  bool started_ = false;
  std::size_t next_ = 0;  // of the recording's frames
  std::uint64_t turn_number_ = 0;
  Duration turn_time_{};  // added to the recorded numbers and times, turn by turn
  bool paced_ = false;
  Timestamp first_due_;      // on the host's clock
  Timestamp first_exposed_;  // in the recording
  RecordedFrame last_;
};

Status ReplayCamera::start() {
  stop();
  if (Status opened = open(); !opened) return opened;
  next_ = 0;
  turn_number_ = 0;
  turn_time_ = Duration::zero();
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

Status ReplayCamera::rewind() try {
  if (recording_.video.empty()) return {};
  video_.release();
  if (video_.open(recording_.video.string())) return {};
  return error(ErrorCode::Unsupported,
               fmt::format("cannot open the video {}: not a format that OpenCV reads here", recording_.video.string()));
} catch (const cv::Exception& failure) {
  return error(ErrorCode::Unsupported,
               fmt::format("cannot open the video {}: {}", recording_.video.string(), failure.what()));
}

// The next frame with its number and time in this turn.
Result<RecordedFrame> ReplayCamera::upcoming() {
  const bool untimed_video = !recording_.video.empty() && recording_.frames.empty();
  if (!untimed_video && next_ == recording_.frames.size()) {
    return error(ErrorCode::EndOfStream, "the recording is through");
  }
  RecordedFrame frame;
  if (untimed_video) {
    frame.number = next_;
    frame.exposed_at = Timestamp{from_s(static_cast<double>(next_) / settings_.rate_hz)};
  } else {
    frame = recording_.frames[next_];
  }
  frame.number += turn_number_;
  frame.exposed_at += turn_time_;
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

Status ReplayCamera::load(const RecordedFrame& frame) try {
  if (recording_.video.empty()) {
    image_ = cv::imread(frame.file.string(), cv::IMREAD_GRAYSCALE);
    if (!image_.empty()) return {};
    return error(ErrorCode::Io, fmt::format("cannot read {}: no such image, or broken", frame.file.string()));
  }
  if (!video_.read(read_)) return error(ErrorCode::EndOfStream, "the video is through");
  if (read_.channels() == 1) {
    image_ = read_;
  } else {
    // Blue, green and red as luminance weighs them (ITU-R BT.601); a grey recording comes out as it was.
    cv::transform(read_, image_, cv::Matx13f(0.114F, 0.587F, 0.299F));
  }
  return {};
} catch (const cv::Exception& failure) {
  return error(ErrorCode::Io, fmt::format("cannot read frame {}: {}", frame.number, failure.what()));
}

Result<Frame> ReplayCamera::next(Duration patience) {
  if (!started_) return error(ErrorCode::DeviceLost, "not started");
  Result<RecordedFrame> coming = upcoming();
  if (coming && !wait_until_due(*coming, patience)) return Error{ErrorCode::Timeout, {}};
  Status loaded = coming ? load(*coming) : Status{coming.error()};
  if (!loaded && loaded.error().code == ErrorCode::EndOfStream && settings_.loop && next_ > 0) {
    // The next turn begins one mean period after the last frame.
    const auto period = from_s(1.0 / settings_.rate_hz);
    const bool timed = recording_.frames.size() > 1;
    const Duration step = timed ? (recording_.frames.back().exposed_at - recording_.frames.front().exposed_at) /
                                      static_cast<std::int64_t>(recording_.frames.size() - 1)
                                : period;
    const RecordedFrame first = recording_.frames.empty() ? RecordedFrame{} : recording_.frames.front();
    turn_number_ = last_.number + 1 - first.number;
    turn_time_ = last_.exposed_at + step - first.exposed_at;
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
  frame.image = {
      {reinterpret_cast<const std::byte*>(image_.data), image_.step[0] * static_cast<std::size_t>(image_.rows)},
      image_.step[0],
      image_.cols,
      image_.rows,
      PixelFormat::Mono8};
  return frame;
}

}  // namespace

std::unique_ptr<Camera> make_replay_camera(CameraId id, std::string name, ReplaySettings settings) {
  return std::make_unique<ReplayCamera>(id, std::move(name), std::move(settings));
}

Result<std::unique_ptr<Camera>> open_replay_camera(CameraId id, const std::string& name, const ReplaySettings& settings,
                                                   const CameraSurroundings& /*surroundings*/) {
  return make_replay_camera(id, name, settings);
}

}  // namespace mocap::cameras
