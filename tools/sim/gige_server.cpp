#include "gige_server.h"

#include <arpa/inet.h>
#include <arv.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <time.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "base/log.h"
#include "gige_device.h"
#include "pixel_packer.h"
#include "stage.h"

namespace mocap::sim {
namespace {

constexpr std::int64_t kMostBehind = 24,
                       kMostBehindDrawn = 2;  // images; an image that must be drawn first cannot catch up
constexpr std::int64_t kLookAtStop_ns = 20'000'000;
constexpr std::int64_t kMostEarly_ns = 150'000;
constexpr std::int64_t kForgets_ns = 12'000'000, kRehearsal_ns = 60'000;
constexpr Duration kLookForClient = std::chrono::milliseconds(2);
constexpr Duration kLookForTrigger = std::chrono::microseconds(200);
constexpr Duration kLookForAction = std::chrono::milliseconds(20);

std::int64_t utc_ns() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return now.tv_sec * 1'000'000'000 + now.tv_nsec;
}

void sleep_until_utc(std::int64_t at_ns) {
  const timespec until{at_ns / 1'000'000'000, at_ns % 1'000'000'000};
  clock_nanosleep(CLOCK_REALTIME, TIMER_ABSTIME, &until, nullptr);
}

/// Waits for an instant of UTC with less jitter than a sleep. The kernel wakes a sleeping thread some tens of
/// microseconds late, so the sleep ends earlier by the previous lateness and the thread polls the clock for the rest.
class Alarm {
 public:
  void wait_until(std::int64_t at_ns) {
    const std::int64_t asked_ns = at_ns - early_ns_;
    if (utc_ns() < asked_ns) {
      sleep_until_utc(asked_ns);
      const std::int64_t late_ns = utc_ns() - asked_ns;
      early_ns_ = std::clamp<std::int64_t>(early_ns_ + (late_ns - early_ns_) / 8, 0, kMostEarly_ns);
    }
    while (utc_ns() < at_ns) continue;
  }

 private:
  std::int64_t early_ns_ = 0;
};

/// One GigE Vision camera: the device, and the thread that exposes and sends images.
class GigeCamera {
 public:
  GigeCamera(const Options& options, const scene::Volume& volume, std::size_t camera, Stage& stage)
      : options_(options),
        model_(volume.rig()[camera]),
        stage_(stage),
        sign_(camera % 2 == 0 ? 1.0 : -1.0),
        random_(options.image.seed * 1009 + camera) {
    if (options.loop_images > 0) {
      loop_ = std::make_unique<Loop>(volume, camera, options.loop_images, options.rate_hz, 1e-6 * options.exposure_us);
    } else {
      ahead_ = std::make_unique<Ahead>(volume, camera, stage);
    }
  }

  Status open(const std::string& address, const std::string& serial, std::uint64_t seed) {
    GigeDevice::Settings settings;
    settings.address = address;
    settings.serial = serial;
    settings.width_px = static_cast<std::uint32_t>(model_.width_px);
    settings.height_px = static_cast<std::uint32_t>(model_.height_px);
    settings.rate_hz = options_.rate_hz;
    settings.exposure_us = options_.exposure_us;
    settings.lost_share = options_.packet_loss;
    settings.resends = !options_.no_resend;
    settings.clock_skew_us = sign_ * options_.clock_skew_us;
    settings.clock_drift_ppm = sign_ * options_.clock_drift_ppm;
    settings.seed = seed;
    auto device = GigeDevice::serve(settings);
    if (!device) return Error{device.error().code, fmt::format("camera '{}': {}", model_.name, device.error().message)};
    device_ = std::move(*device);
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
    log_info("camera " + model_.name, fmt::format("served address={} serial={} size={}x{} rate={:.1f}Hz", address,
                                                  serial, model_.width_px, model_.height_px, options_.rate_hz));
    return {};
  }

 private:
  void run(const std::stop_token& stop) {
    prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);  // ns; the default of 50 us would delay every exposure
    unsigned acquisition = 0;
    while (!stop.stop_requested()) {
      if (!device_->acquiring()) {
        std::this_thread::sleep_for(kLookForClient);
        continue;
      }
      if (acquisition != device_->acquisitions()) {
        acquisition = device_->acquisitions();
        images_ = 0;
      }
      switch (device_->trigger()) {
        case GigeDevice::Trigger::Software: expose_when_triggered(); break;
        case GigeDevice::Trigger::Action: expose_on_action(); break;
        default: expose_by_the_clock(stop);
      }
    }
  }

  void expose_when_triggered() {
    std::this_thread::sleep_for(kLookForTrigger);
    if (!device_->take_software_trigger()) return;
    const std::int64_t period_us = device_->period_us();
    const std::int64_t number = utc_ns() / 1000 / period_us;
    send(expose(number, number * period_us * 1000));
  }

  // An action command starts an exposure on arrival or at the scheduled instant.
  void expose_on_action() {
    const auto begins_ns = device_->actions().next_utc_ns(kLookForAction);
    if (!begins_ns) return;
    const std::int64_t period_ns = std::int64_t{device_->period_us()} * 1000;
    const std::int64_t end_ns = *begins_ns + std::int64_t{device_->exposure_us()} * 1000;
    // The first image number is the number of the UTC period, so that all cameras show the same image of a loop. Later
    // numbers follow from the time between commands.
    last_number_ =
        last_action_ns_ == 0
            ? *begins_ns / period_ns
            : last_number_ + std::max<std::int64_t>(1, (*begins_ns - last_action_ns_ + period_ns / 2) / period_ns);
    last_action_ns_ = *begins_ns;
    const ServedImage image = expose(last_number_, end_ns);
    send_at(image, end_ns + late_ns(period_ns / 1000));
  }

  // An exposure ends at a whole period of UTC, both in free run and with a trigger line. The image is drawn in advance
  // so that it is sent on time.
  void expose_by_the_clock(const std::stop_token& stop) {
    const std::int64_t period_us = device_->period_us();
    // On a busy host images leave late, which a real camera would not do. Images that are more than kMostBehind periods
    // late are skipped.
    const std::int64_t due = utc_ns() / 1000 / period_us + 1;
    const bool catches_up = due - last_number_ <= (loop_ ? kMostBehind : kMostBehindDrawn);
    last_number_ = catches_up ? last_number_ + 1 : due;
    const std::int64_t end_ns = last_number_ * period_us * 1000;
    const ServedImage image = expose(last_number_, end_ns);
    const std::int64_t leaves_ns = end_ns + late_ns(period_us);
    for (std::int64_t now_ns = utc_ns(); leaves_ns - now_ns > kLookAtStop_ns; now_ns = utc_ns()) {
      sleep_until_utc(now_ns + kLookAtStop_ns / 2);
      if (stop.stop_requested() || !device_->acquiring()) return;
    }
    send_at(image, leaves_ns);
  }

  ServedImage expose(std::int64_t number, std::int64_t end_utc_ns) {
    const std::uint32_t exposure_us = device_->exposure_us();
    const Exposure wanted = stage_.exposure(number, device_->period_us(), exposure_us, end_utc_ns);
    ServedImage image = device_->layout();
    Exposure drawn = wanted;
    const auto fill = [&](const std::vector<std::byte>& pixels) { copy(pixels, image); };
    if (loop_) {
      fill(loop_->image(number));
    } else {
      drawn = ahead_->deliver(wanted, fill);
    }
    image.id = static_cast<std::uint16_t>(1 + number % 65535);
    image.stamp_ns = device_->clock().stamp_ns(end_utc_ns - std::int64_t{exposure_us} * 1000);
    image.chunk_stamp_ns = image.stamp_ns;
    if (!streams_) stage_.streams(drawn);
    streams_ = true;
    stage_.exposed(drawn);
    return image;
  }

  // A real camera sends on time after any pause, but a processor that slept is some 30 us late. A rehearsal warms the
  // caches.
  void send_at(const ServedImage& image, std::int64_t leaves_ns) {
    if (leaves_ns - sent_ns_ > kForgets_ns) {
      alarm_.wait_until(leaves_ns - kRehearsal_ns);
      device_->rehearse(image);
    }
    alarm_.wait_until(leaves_ns);
    if (!device_->acquiring()) return;
    sent_ns_ = leaves_ns;
    send(image);
  }

  void send(const ServedImage& image) {
    ++images_;
    if (options_.silent_after > 0 && images_ > options_.silent_after) return;
    if (options_.skip_every > 0 && images_ % options_.skip_every == 0) return;
    device_->send(image);
    if (options_.repeat_every > 0 && images_ % options_.repeat_every == 0) device_->send(image);
  }

  std::int64_t late_ns(std::int64_t period_us) {
    if (options_.delivery_jitter_us <= 0.0) return 0;
    const double late_us = std::exponential_distribution<>(1.0 / options_.delivery_jitter_us)(random_);
    return std::llround(1e3 * std::min(late_us, 0.9 * static_cast<double>(period_us)));
  }

  // Copies the region chosen by the client. Pixels outside of the sensor are black.
  void copy(const std::vector<std::byte>& pixels, const ServedImage& region) {
    const std::size_t left = region.left, top = region.top;
    const auto sensor_width = static_cast<std::size_t>(model_.width_px);
    const auto sensor_height = static_cast<std::size_t>(model_.height_px);
    const std::size_t shown = left < sensor_width ? std::min<std::size_t>(region.width, sensor_width - left) : 0;
    Packer packer(device_->room(), region.pixel_format);
    std::vector<std::byte>& row = row_;
    row.assign(region.width, std::byte{0});
    for (std::size_t y = 0; y < region.height; ++y) {
      const bool inside = y + top < sensor_height;
      if (inside && shown == region.width) {
        packer.add(std::span(pixels).subspan((y + top) * sensor_width + left, shown));
        continue;
      }
      std::fill(row.begin(), row.end(), std::byte{0});
      if (inside) std::memcpy(row.data(), pixels.data() + (y + top) * sensor_width + left, shown);
      packer.add(row);
    }
  }

  const Options& options_;
  const CameraModel& model_;
  Stage& stage_;
  double sign_;  // sign of clock offset and drift: alternates from camera to camera
  std::mt19937_64 random_;
  Alarm alarm_;
  std::unique_ptr<Loop> loop_;
  std::unique_ptr<Ahead> ahead_;
  std::unique_ptr<GigeDevice> device_;
  std::vector<std::byte> row_;
  std::int64_t images_ = 0;  // images since the start of the acquisition
  std::int64_t last_number_ = 0;
  std::int64_t sent_ns_ = 0;
  std::int64_t last_action_ns_ = 0;  // start of the last exposure by an action command
  bool streams_ = false;
  std::jthread thread_;  // declared last, so that the thread ends before the members that it uses are destroyed
};

std::string address_after(const std::string& first, std::size_t steps) {
  in_addr address{};
  inet_pton(AF_INET, first.c_str(), &address);
  address.s_addr = htonl(ntohl(address.s_addr) + static_cast<std::uint32_t>(steps));
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return text.data();
}

}  // namespace

Status serve_gige(const Options& options, const scene::Volume& volume, TruthFile& truth, const std::atomic<bool>& end) {
  std::vector<std::size_t> served;
  for (std::size_t i = 0; i < volume.rig().size(); ++i) {
    if (!options.only || static_cast<std::size_t>(*options.only) == i + 1) served.push_back(i);
  }
  if (served.empty()) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("--only {}: the rig has {} cameras", *options.only, volume.rig().size())};
  }
  Stage stage(served.size(), options.epoch_ns);
  std::vector<std::unique_ptr<GigeCamera>> cameras;
  for (const std::size_t i : served) {
    cameras.push_back(std::make_unique<GigeCamera>(options, volume, i, stage));
    const auto opened = cameras.back()->open(address_after(options.first_address, i),
                                             fmt::format("{}{:03}", options.serial_prefix, i + 1), i + 1);
    if (!opened) return opened;
  }

  const auto write_exposed = [&] {
    for (const Timestamp at : stage.take_exposed()) truth.write(stage.motion_s(at), at);
  };
  const Timestamp began_at = host_now();
  while (!end && (options.seconds <= 0.0 || to_s(host_now() - began_at) < options.seconds)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    stage.follow_utc();
    write_exposed();
  }
  cameras.clear();
  write_exposed();
  return truth.finish();
}

}  // namespace mocap::sim
