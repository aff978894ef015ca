#include "usb3_server.h"

#include <fmt/format.h>
#include <time.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/log.h"
#include "base/time.h"
#include "pixel_packer.h"
#include "stage.h"
#include "usb3_addresses.h"
#include "usb3_gadget.h"
#include "usb3_registers.h"

namespace mocap::sim {
namespace {

constexpr std::uint32_t kUsbLeader = 0x4c563355, kUsbTrailer = 0x54563355;  // "U3VL", "U3VT"
constexpr Duration kLookForUsbClient = std::chrono::milliseconds(2);
constexpr std::size_t kMostTransfer_bytes = 1 << 20;

template <class T>
void set_field(std::span<std::byte> bytes, std::size_t place, T value) {
  std::memcpy(bytes.data() + place, &value, sizeof value);
}

class Usb3Camera {
 public:
  Usb3Camera(const Options& options, const scene::Volume& volume, std::size_t camera)
      : model_(volume.rig()[camera]),
        registers_({.serial = fmt::format("{}{:03}", options.serial_prefix, camera + 1),
                    .width_px = static_cast<std::uint32_t>(model_.width_px),
                    .height_px = static_cast<std::uint32_t>(model_.height_px),
                    .rate_hz = options.rate_hz,
                    .exposure_us = options.exposure_us}),
        loop_(volume, camera, options.loop_images > 0 ? options.loop_images : kUsualLoop, options.rate_hz,
              1e-6 * options.exposure_us) {}

  Status plug_in(const Usb3Gadget::Settings& settings) {
    auto gadget = Usb3Gadget::plug_in(settings, registers_);
    if (!gadget) return Error{gadget.error().code, fmt::format("camera '{}': {}", model_.name, gadget.error().message)};
    gadget_ = std::move(*gadget);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    log_info("camera " + model_.name, fmt::format("plugged in serial={} controller={} size={}x{}", settings.serial,
                                                  settings.controller, model_.width_px, model_.height_px));
    return {};
  }

 private:
  void run(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!registers_.streaming()) {
        block_id_ = 0;
        std::this_thread::sleep_for(kLookForUsbClient);
        continue;
      }
      const bool asked = registers_.trigger() != Usb3Registers::Trigger::Software || registers_.take_software_trigger();
      if (!asked) {
        std::this_thread::sleep_for(kLookForUsbClient);
        continue;
      }
      expose(stop);
    }
  }

  // Skips images that would be too late, with their numbers, like a camera whose buffer is full.
  void expose(const std::stop_token& stop) {
    const auto period_ns = static_cast<std::int64_t>(1e9 / registers_.rate_hz());
    const std::int64_t number = std::max(to_ns(host_now()) / period_ns + 1, last_number_ + 1);
    block_id_ += last_number_ > 0 && block_id_ > 0 ? static_cast<std::uint64_t>(number - last_number_) : 1;
    last_number_ = number;
    const Usb3Registers::Layout layout = registers_.layout();
    draw(layout, number);
    const std::int64_t end_ns = number * period_ns;
    while (to_ns(host_now()) < end_ns && !stop.stop_requested()) {
      std::this_thread::sleep_for(std::min<Duration>(Duration{end_ns - to_ns(host_now())}, kLookAtStop));
    }
    send(layout, end_ns - std::llround(1e3 * registers_.exposure_us()));
  }

  // Draws the region chosen by the client. Pixels outside of the sensor are black.
  void draw(const Usb3Registers::Layout& layout, std::int64_t number) {
    const std::vector<std::byte>& pixels = loop_.image(number);
    payload_.assign(layout.payload_bytes, std::byte{0});
    Packer packer(payload_, layout.pixel_format);
    const auto sensor_width = static_cast<std::size_t>(model_.width_px);
    const auto sensor_height = static_cast<std::size_t>(model_.height_px);
    for (std::size_t y = layout.top_px; y < std::size_t{layout.top_px} + layout.height_px; ++y) {
      row_.assign(layout.width_px, std::byte{0});
      if (y < sensor_height && layout.left_px < sensor_width) {
        const std::size_t shown = std::min<std::size_t>(layout.width_px, sensor_width - layout.left_px);
        std::memcpy(row_.data(), pixels.data() + y * sensor_width + layout.left_px, shown);
      }
      packer.add(row_);
    }
  }

  // Sends leader, payload and trailer. Source: USB3 Vision 1.0.1, section 5.3.
  void send(const Usb3Registers::Layout& layout, std::int64_t stamp_ns) {
    std::array<std::byte, usb3::kLeaderBytes> leader{};
    set_field(leader, 0, kUsbLeader);
    set_field(leader, 6, std::uint16_t{usb3::kLeaderBytes});
    set_field(leader, 8, block_id_);
    set_field(leader, 18, std::uint16_t{1});  // payload type: image
    set_field(leader, 20, stamp_ns);
    const std::uint32_t values[] = {layout.pixel_format, layout.width_px, layout.height_px, layout.left_px,
                                    layout.top_px};
    for (std::size_t i = 0; i < std::size(values); ++i) set_field(leader, 28 + 4 * i, values[i]);
    std::array<std::byte, usb3::kTrailerBytes> trailer{};
    set_field(trailer, 0, kUsbTrailer);
    set_field(trailer, 6, std::uint16_t{usb3::kTrailerBytes});
    set_field(trailer, 8, block_id_);
    set_field(trailer, 20, std::uint64_t{payload_.size()});
    set_field(trailer, 28, layout.height_px);
    if (!gadget_->send(leader)) return;
    for (std::size_t begin = 0; begin < payload_.size(); begin += kMostTransfer_bytes) {
      const std::size_t count = std::min(kMostTransfer_bytes, payload_.size() - begin);
      if (!gadget_->send(std::span(payload_).subspan(begin, count))) return;
    }
    gadget_->send(trailer);
  }

  static constexpr Duration kLookAtStop = std::chrono::milliseconds(20);

  const CameraModel& model_;
  Usb3Registers registers_;
  Loop loop_;
  std::unique_ptr<Usb3Gadget> gadget_;
  std::vector<std::byte> payload_, row_;
  std::uint64_t block_id_ = 0;
  std::int64_t last_number_ = 0;
  std::jthread thread_;  // declared last, so that the thread ends before the members that it uses are destroyed
};

}  // namespace

Status serve_usb3(const Options& options, const scene::Volume& volume, const std::atomic<bool>& end) {
  std::vector<std::unique_ptr<Usb3Camera>> cameras;
  for (std::size_t i = 0; i < volume.rig().size(); ++i) {
    cameras.push_back(std::make_unique<Usb3Camera>(options, volume, i));
    const bool one = options.usb_one_controller;
    const auto plugged =
        cameras.back()->plug_in({.name = fmt::format("mocap{}{}", one ? "-one-" : "", i + 1),
                                 .serial = fmt::format("{}{:03}", options.serial_prefix, i + 1),
                                 .controller = fmt::format("{}.{}", one ? "usbip-vudc" : "dummy_udc", i),
                                 .port = static_cast<unsigned>(i)});
    if (!plugged) return plugged;
  }
  const Timestamp began_at = host_now();
  while (!end && (options.seconds <= 0.0 || to_s(host_now() - began_at) < options.seconds)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return {};
}

}  // namespace mocap::sim
