#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <variant>
#include <vector>

#include "base/wake_signal.h"
#include "module/camera.h"

namespace mocap::support {

/// A step of a scripted camera: the image that one call of `next` returns.
struct Deliver {
  std::uint64_t number;
  int width_px = 64;
  int height_px = 48;
};
using Step = std::variant<Deliver, Error>;

/// A camera that follows a script, for faults that a real camera does not have on demand. Each start begins the next
/// list of steps; without a further list it fails with NotFound. After the last step of a list, no image comes.
class ScriptedCamera : public Camera {
 public:
  ScriptedCamera(CameraId id, std::deque<std::vector<Step>> starts) : id_(id), starts_(std::move(starts)) {}

  Status start() override {
    if (starts_.empty()) return Error{ErrorCode::NotFound, "nothing plugged in"};
    list_ = std::move(starts_.front());
    starts_.pop_front();
    next_ = 0;
    return {};
  }

  Result<Frame> next(Duration patience) override {
    if (next_ == list_.size()) {
      nothing_comes_.wait(nothing_comes_.ticket(), patience);
      return Error{ErrorCode::Timeout, {}};
    }
    const Step& step = list_[next_++];
    if (const Error* error = std::get_if<Error>(&step)) return *error;
    const Deliver& deliver = std::get<Deliver>(step);
    pixels_.assign(static_cast<std::size_t>(deliver.width_px * deliver.height_px), std::byte{0});
    const Timestamp at = from_ns(1'000'000'000 + 10'000'000 * static_cast<std::int64_t>(deliver.number));
    return Frame{id_, deliver.number, at, at,
                 Image{pixels_, static_cast<std::size_t>(deliver.width_px), deliver.width_px, deliver.height_px,
                       PixelFormat::Mono8}};
  }

  void stop() noexcept override {}

 private:
  CameraId id_;
  std::deque<std::vector<Step>> starts_;
  std::vector<Step> list_;
  std::size_t next_ = 0;
  std::vector<std::byte> pixels_;
  WakeSignal nothing_comes_;
};

}  // namespace mocap::support
