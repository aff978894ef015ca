#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "base/time.h"
#include "gige_device.h"

namespace mocap::cameras {

/// A GigE Vision camera of the simulator's own server, in this process: every byte of image k is k modulo 256.
class ServedGigE {
 public:
  struct Faults {
    int repeat_every = 0;  ///< sends each n-th image twice
    int skip_every = 0;    ///< never sends each n-th image
    int silent_after = 0;  ///< sends no more than so many since the client began
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

  bool running() const { return device_ != nullptr; }
  std::uint64_t sent() const { return sent_; }

 private:
  void run(const std::stop_token& stop) {
    unsigned acquisition = 0;
    std::uint64_t number = 0;
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::microseconds(device_->period_us()));
      if (!device_->acquiring()) continue;
      const bool triggered = device_->trigger() == sim::GigeDevice::Trigger::Software;
      if (triggered && !device_->take_software_trigger()) continue;
      if (std::exchange(acquisition, device_->acquisitions()) != acquisition) number = 0;
      ++number;
      if (faults_.silent_after > 0 && number > static_cast<std::uint64_t>(faults_.silent_after)) continue;
      sim::ServedImage image = device_->layout();
      image.id = static_cast<std::uint16_t>(1 + (number - 1) % 65535);
      image.stamp_ns = static_cast<std::uint64_t>(to_ns(host_now()));
      std::ranges::fill(device_->room(), static_cast<std::byte>(number));
      if (faults_.skip_every > 0 && number % static_cast<std::uint64_t>(faults_.skip_every) == 0) continue;
      device_->send(image);
      if (faults_.repeat_every > 0 && number % static_cast<std::uint64_t>(faults_.repeat_every) == 0) {
        device_->send(image);
      }
      ++sent_;
    }
  }

  Faults faults_;
  std::unique_ptr<sim::GigeDevice> device_;
  std::atomic<std::uint64_t> sent_{0};
  std::jthread thread_;
};

}  // namespace mocap::cameras
