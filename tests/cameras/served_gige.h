#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "base/time.h"
#include "gige_device.h"

namespace mocap::cameras {

/// A GigE Vision camera in this process, by the server of the simulator: every byte of image k is k modulo 256.
class ServedGigE {
 public:
  struct Faults {
    int repeat_every = 0;                     ///< sends every n-th image twice; 0: never
    int skip_every = 0;                       ///< omits every n-th image; 0: never
    int silent_after = 0;                     ///< sends this many images per acquisition; 0: no limit
    bool varies = false;                      ///< image k is exposed for `varied_us(k)`
    Duration leader_late = Duration::zero();  ///< stamp of the leader minus begin of the exposure
  };

  ServedGigE(sim::GigeDevice::Settings settings, Faults faults) : faults_(faults) {
    auto device = sim::GigeDevice::serve(settings);
    if (!device) return;
    device_ = std::move(*device);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  ServedGigE(const std::string& address, const std::string& serial) : ServedGigE(at(address, serial), Faults{}) {}
  explicit ServedGigE(const sim::GigeDevice::Settings& settings) : ServedGigE(settings, Faults{}) {}

  static sim::GigeDevice::Settings at(const std::string& address, const std::string& serial) {
    sim::GigeDevice::Settings settings;
    settings.address = address;
    settings.serial = serial;
    settings.width_px = 320;
    settings.height_px = 240;
    settings.rate_hz = 100.0;
    return settings;
  }

  static double varied_us(std::uint64_t number) { return 200.0 + 150.0 * static_cast<double>(number % 12); }

  bool running() const { return device_ != nullptr; }
  sim::GigeDevice& device() { return *device_; }
  /// Begin of the exposure of image `number`, UTC; the last 256 images are known.
  Duration began_utc(std::uint64_t number) const { return Duration{began_utc_ns_[number % 256]}; }
  std::uint64_t sent() const { return sent_; }

 private:
  void run(const std::stop_token& stop) {
    unsigned acquisition = 0;
    std::uint64_t number = 0;
    while (!stop.stop_requested()) {
      const std::optional<std::int64_t> begins_utc_ns = next_exposure();
      if (!begins_utc_ns || !device_->acquiring()) continue;
      if (std::exchange(acquisition, device_->acquisitions()) != acquisition) number = 0;
      ++number;
      if (faults_.silent_after > 0 && number > static_cast<std::uint64_t>(faults_.silent_after)) continue;
      send_image(number, *begins_utc_ns);
    }
  }

  static std::int64_t utc_now_ns() { return to_ns(host_now()) + utc_minus_host().count(); }

  // Waits for the next exposure: by period, software trigger or action command.
  std::optional<std::int64_t> next_exposure() {
    if (device_->acquiring() && device_->trigger() == sim::GigeDevice::Trigger::Action) {
      const auto begins = device_->actions().next_utc_ns(std::chrono::milliseconds(20));
      if (begins) std::this_thread::sleep_for(Duration{*begins - utc_now_ns()});
      return begins;
    }
    std::this_thread::sleep_for(std::chrono::microseconds(device_->period_us()));
    if (!device_->acquiring()) return std::nullopt;
    const bool triggered = device_->trigger() == sim::GigeDevice::Trigger::Software;
    if (triggered && !device_->take_software_trigger()) return std::nullopt;
    return utc_now_ns();
  }

  void send_image(std::uint64_t number, std::int64_t begins_utc_ns) {
    sim::ServedImage image = device_->layout();
    image.id = static_cast<std::uint16_t>(1 + (number - 1) % 65535);
    image.chunk_stamp_ns = device_->clock().stamp_ns(begins_utc_ns);
    image.stamp_ns = image.chunk_stamp_ns + static_cast<std::uint64_t>(faults_.leader_late.count());
    if (faults_.varies) image.exposure_us = varied_us(number);
    began_utc_ns_[number % 256] = begins_utc_ns;
    std::ranges::fill(device_->room(), static_cast<std::byte>(number));
    if (faults_.skip_every > 0 && number % static_cast<std::uint64_t>(faults_.skip_every) == 0) return;
    device_->send(image);
    if (faults_.repeat_every > 0 && number % static_cast<std::uint64_t>(faults_.repeat_every) == 0) {
      device_->send(image);
    }
    ++sent_;
  }

  Faults faults_;
  std::unique_ptr<sim::GigeDevice> device_;
  std::array<std::atomic<std::int64_t>, 256> began_utc_ns_{};
  std::atomic<std::uint64_t> sent_{0};
  std::jthread thread_;
};

}  // namespace mocap::cameras
