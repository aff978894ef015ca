#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "base/time.h"
#include "scene/volume.h"

namespace mocap::sim {

/// One exposure: the number of its UTC period, and its middle on the host's monotonic clock.
struct Exposure {
  std::int64_t number = -1;
  std::int64_t period_us = 0;
  std::uint32_t length_us = 0;
  Timestamp middle;
};

/// State shared by the camera threads: the start of the motion, the offset of UTC to the host's clock, and the list of
/// exposures. Any thread.
class Stage {
 public:
  /// Value of the start of the motion before the motion starts.
  static constexpr std::int64_t kHeld = std::numeric_limits<std::int64_t>::max();

  Stage(std::size_t cameras, std::optional<std::int64_t> epoch_ns) : waiting_for_(cameras) {
    if (epoch_ns) begin_ns_ = *epoch_ns;
    follow_utc();
  }

  /// Updates the offset of UTC to the host's clock.
  void follow_utc() { utc_minus_host_ns_ = utc_minus_host().count(); }

  Exposure exposure(std::int64_t number, std::int64_t period_us, std::uint32_t length_us,
                    std::int64_t end_utc_ns) const {
    const std::int64_t middle_utc_ns = end_utc_ns - std::int64_t{length_us} * 500;
    return {number, period_us, length_us, from_ns(middle_utc_ns - utc_minus_host_ns_)};
  }

  /// Time since the start of the motion, s; 0 before the start.
  double motion_s(Timestamp at) const {
    const std::int64_t begin_ns = begin_ns_;
    return begin_ns == kHeld ? 0.0 : std::max(0.0, to_s(Duration{to_ns(at) - begin_ns}));
  }

  /// Reports the first image of a camera. After the last camera's first image the motion starts with a delay of 4
  /// periods, so that images that are already drawn precede the start.
  void streams(const Exposure& exposure) {
    if (--waiting_for_ != 0 || begin_ns_ != kHeld) return;
    begin_ns_ = to_ns(exposure.middle) + 4 * exposure.period_us * 1000;
    log_info("sim", "all cameras stream; the motion begins");
  }

  void exposed(const Exposure& exposure) {
    const std::scoped_lock lock(mutex_);
    // The same instant of another camera may differ by the jitter of reading two clocks.
    if (exposure.middle <= newest_ + Duration{exposure.period_us * 500}) return;
    newest_ = exposure.middle;
    exposed_.push_back(exposure.middle);
  }

  /// Returns the exposures since the last call.
  std::deque<Timestamp> take_exposed() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(exposed_, {});
  }

 private:
  std::atomic<std::size_t> waiting_for_;
  std::atomic<std::int64_t> begin_ns_{kHeld};
  std::atomic<std::int64_t> utc_minus_host_ns_{0};
  std::mutex mutex_;
  Timestamp newest_;
  std::deque<Timestamp> exposed_;
};

/// A thread that draws the next image while the current image is sent.
class Ahead {
 public:
  // Largest difference between the drawn and the actual exposure time. A marker at 5 m/s moves by 0.5 mm.
  static constexpr Duration kSameInstant = std::chrono::microseconds(100);

  Ahead(const scene::Volume& volume, std::size_t camera, const Stage& stage)
      : eye_(volume, camera), stage_(stage), thread_([this](const std::stop_token& stop) { run(stop); }) {
    const CameraModel& model = volume.rig()[camera];
    pixels_.resize(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px));
  }

  /// Calls `take` with the image of `exposure`, which usually is already drawn, and starts to draw the next image.
  /// Returns the exposure that was drawn.
  template <class Take>
  Exposure deliver(const Exposure& exposure, Take take) {
    std::unique_lock lock(mutex_);
    const auto is_ready = [&] {
      return ready_.number == exposure.number && ready_.period_us == exposure.period_us &&
             ready_.length_us == exposure.length_us && std::chrono::abs(ready_.middle - exposure.middle) < kSameInstant;
    };
    // Wait for the image in progress. If it is another exposure, request the right one.
    changed_.wait(lock, [&] { return !wanted_; });
    if (!is_ready()) {
      wanted_ = exposure;
      changed_.notify_all();
      changed_.wait(lock, [&] { return !wanted_; });
    }
    take(pixels_);
    const Exposure drawn = ready_;
    wanted_ = exposure;
    ++wanted_->number;
    wanted_->middle += std::chrono::microseconds(exposure.period_us);
    changed_.notify_all();
    return drawn;
  }

 private:
  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (changed_.wait(lock, stop, [&] { return wanted_.has_value(); })) {
      const Exposure exposure = *wanted_;
      lock.unlock();
      eye_.see(stage_.motion_s(exposure.middle), 1e-6 * exposure.length_us, static_cast<std::uint64_t>(exposure.number),
               pixels_);
      lock.lock();
      ready_ = exposure;
      wanted_.reset();
      changed_.notify_all();
    }
  }

  scene::Eye eye_;
  const Stage& stage_;
  std::vector<std::byte> pixels_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  std::optional<Exposure> wanted_;
  Exposure ready_;
  std::jthread thread_;
};

/// Images drawn in advance and shown forwards and backwards, for benchmarks of the receiver without the cost of
/// drawing.
class Loop {
 public:
  Loop(const scene::Volume& volume, std::size_t camera, int images, double rate_hz, double exposure_s) {
    scene::Eye eye(volume, camera);
    const CameraModel& model = volume.rig()[camera];
    images_.resize(static_cast<std::size_t>(images));
    for (std::size_t i = 0; i < images_.size(); ++i) {
      images_[i].resize(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px));
      eye.see(static_cast<double>(i) / rate_hz, exposure_s, i, images_[i]);
    }
  }

  const std::vector<std::byte>& image(std::int64_t number) const {
    const auto count = static_cast<std::int64_t>(images_.size());
    const std::int64_t place = count > 1 ? number % (2 * count - 2) : 0;
    return images_[static_cast<std::size_t>(place < count ? place : 2 * count - 2 - place)];
  }

 private:
  std::vector<std::vector<std::byte>> images_;
};

}  // namespace mocap::sim
