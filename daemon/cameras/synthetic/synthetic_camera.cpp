#include "cameras/synthetic/synthetic_camera.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "scene/procedural_actor.h"
#include "scene/volume.h"

namespace mocap::cameras {
namespace {

void sleep_until(Timestamp at) {
  const std::int64_t ns = to_ns(at);
  const timespec until{ns / 1'000'000'000, ns % 1'000'000'000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

class SyntheticCamera final : public Camera {
 public:
  SyntheticCamera(CameraId id, SyntheticSettings settings, CameraModel model, MarkerSet marker_set)
      : id_(id), settings_(std::move(settings)), model_(std::move(model)), marker_set_(std::move(marker_set)) {}

  Status start() override {
    if (!(settings_.rate_hz > 0.0) || settings_.speed < 0.0 || model_.width_px <= 0 || model_.height_px <= 0) {
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("camera '{}': rate {} Hz, speed {}, size {}x{}; expected a rate over 0, a speed of 0 or "
                               "more and a size over 0",
                               model_.name, settings_.rate_hz, settings_.speed, model_.width_px, model_.height_px)};
    }
    auto program = scene::parse_program(settings_.motion);
    if (!program) {
      return Error{ErrorCode::InvalidArgument, fmt::format("camera '{}': {}", model_.name, program.error().message)};
    }
    scene::ImageSettings image;
    image.exposure_s = settings_.exposure_us * 1e-6;
    image.read_noise_grey = settings_.noise_grey;
    image.seed = settings_.seed;
    eye_.reset();
    volume_ = std::make_unique<scene::Volume>(scene::make_procedural_actor(marker_set_, std::move(*program)),
                                              Rig{model_}, image);
    // Each camera has a volume of its own; the id makes the noise of cameras differ.
    eye_ = std::make_unique<scene::Eye>(*volume_, 0, id_.value);
    pixels_.resize(static_cast<std::size_t>(model_.width_px) * static_cast<std::size_t>(model_.height_px));
    next_ = 0;
    began_at_ = settings_.epoch;
    if (settings_.speed > 0.0 && began_at_ == Timestamp{}) began_at_ = host_now();
    running_ = true;
    return {};
  }

  Result<Frame> next(Duration patience) override {
    if (!running_) return Error{ErrorCode::DeviceLost, {}};
    if (settings_.speed > 0.0) {
      const Timestamp now = host_now();
      next_ = std::max(next_, newest(now));
      const Timestamp due = due_at(next_);
      if (due > now + patience) {
        sleep_until(now + patience);
        return Error{ErrorCode::Timeout, {}};
      }
      sleep_until(due);
    }
    const double t_s = static_cast<double>(next_) / settings_.rate_hz;
    eye_->see(t_s, settings_.exposure_us * 1e-6, next_, pixels_);
    const Frame frame{
        id_,
        next_,
        exposed_at(next_),
        settings_.speed > 0.0 ? host_now() : exposed_at(next_),
        {pixels_, static_cast<std::size_t>(model_.width_px), model_.width_px, model_.height_px, PixelFormat::Mono8}};
    ++next_;
    return frame;
  }

  void stop() noexcept override { running_ = false; }
  std::optional<CameraAdjustment> adjustment() const override { return CameraAdjustment{settings_.exposure_us}; }
  Status adjust(const CameraAdjustment& to) override {
    if (to.gain_db) return Error{ErrorCode::Unsupported, "a simulated camera has no gain"};
    settings_.exposure_us = to.exposure_us.value_or(settings_.exposure_us);
    return {};
  }

 private:
  // Middle of the exposure on the clock of the simulated world, which runs `speed` times as fast as the host's clock.
  Timestamp exposed_at(std::uint64_t number) const {
    return began_at_ + from_s(static_cast<double>(number) / settings_.rate_hz);
  }
  // End of the exposure on the host's clock.
  Timestamp due_at(std::uint64_t number) const {
    const double s = static_cast<double>(number) / settings_.rate_hz + 0.5e-6 * settings_.exposure_us;
    return began_at_ + from_s(s / settings_.speed);
  }
  // Number of the newest image that is due; 0 if none is.
  std::uint64_t newest(Timestamp now) const {
    const double s = to_s(now - began_at_) * settings_.speed - 0.5e-6 * settings_.exposure_us;
    return s <= 0.0 ? 0 : static_cast<std::uint64_t>(s * settings_.rate_hz);
  }

  CameraId id_;
  SyntheticSettings settings_;
  CameraModel model_;
  MarkerSet marker_set_;
  std::unique_ptr<scene::Volume> volume_;
  std::unique_ptr<scene::Eye> eye_;
  std::vector<std::byte> pixels_;
  std::uint64_t next_ = 0;
  Timestamp began_at_;
  bool running_ = false;
};

}  // namespace

std::unique_ptr<Camera> make_synthetic_camera(CameraId id, const SyntheticSettings& settings, const CameraModel& model,
                                              const MarkerSet& marker_set) {
  return std::make_unique<SyntheticCamera>(id, settings, model, marker_set);
}

Result<std::unique_ptr<Camera>> open_synthetic_camera(CameraId id, const std::string& name,
                                                      const SyntheticSettings& settings,
                                                      const CameraSurroundings& surroundings) {
  const auto refuse = [&](const char* why) {
    return Error{ErrorCode::InvalidArgument, fmt::format("camera '{}': {}", name, why)};
  };
  if (surroundings.marker_set == nullptr) return refuse("a synthetic camera needs the marker set of its subject");
  const Rig none;
  const Rig& rig = surroundings.rig != nullptr ? *surroundings.rig : none;
  const auto model = std::ranges::find(rig, name, &CameraModel::name);
  if (model == rig.end()) {
    return refuse("a synthetic camera needs its lens and pose, but the rig has no camera of this name");
  }
  return make_synthetic_camera(id, settings, *model, *surroundings.marker_set);
}

}  // namespace mocap::cameras
