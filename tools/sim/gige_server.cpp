#include "gige_server.h"

#include <arpa/inet.h>
#include <arv.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/log.h"
#include "base/time.h"
#include "patient_poll.h"

namespace mocap::sim {
namespace {

constexpr std::int64_t kHeld = std::numeric_limits<std::int64_t>::max();

/// One exposure: which period of UTC it ends with, and its middle on the host's clock.
struct Exposure {
  std::int64_t number = -1;
  std::int64_t period_us = 0;
  std::uint32_t length_us = 0;
  Timestamp middle;
};

/// What the cameras have in common: the motion's clock, the way from UTC to the host's clock, what was exposed.
class Stage {
 public:
  Stage(std::size_t cameras, std::optional<std::int64_t> epoch_ns) : waiting_for_(cameras) {
    if (epoch_ns) begin_ns_ = *epoch_ns;
    follow_utc();
  }

  void follow_utc() { utc_minus_host_ns_ = utc_minus_host().count(); }

  Exposure exposure(std::int64_t number, std::int64_t period_us, std::uint32_t length_us) const {
    const std::int64_t middle_utc_ns = number * period_us * 1000 - std::int64_t{length_us} * 500;
    return {number, period_us, length_us, from_ns(middle_utc_ns - utc_minus_host_ns_)};
  }

  /// Seconds in the motion; 0 until it has begun.
  double motion_s(Timestamp at) const {
    const std::int64_t begin_ns = begin_ns_;
    return begin_ns == kHeld ? 0.0 : std::max(0.0, to_s(Duration{to_ns(at) - begin_ns}));
  }

  /// A camera's first image. With the last camera's the motion begins, late enough that no image of the time after
  /// has been drawn yet.
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

/// A thread that draws the next image while the last one is on its way.
class Ahead {
 public:
  Ahead(const scene::Volume& volume, std::size_t camera, const Stage& stage)
      : eye_(volume, camera), stage_(stage), thread_([this](const std::stop_token& stop) { run(stop); }) {
    const CameraModel& model = volume.rig()[camera];
    pixels_.resize(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px));
  }

  /// Gives the image of `exposure`, drawn already if all went as foreseen, to `take`, and begins the next one.
  /// Returns the exposure as it was drawn.
  template <class Take>
  Exposure deliver(const Exposure& exposure, Take take) {
    std::unique_lock lock(mutex_);
    const auto is_ready = [&] {
      return ready_.number == exposure.number && ready_.period_us == exposure.period_us &&
             ready_.length_us == exposure.length_us;
    };
    // What is being drawn may be it; if not, ask for it.
    changed_.wait(lock, [&] { return !wanted_; });
    if (!is_ready()) {
      wanted_ = exposure;
      changed_.notify_all();
      changed_.wait(lock, [&] { return !wanted_; });
    }
    take(pixels_);
    const Exposure drawn = ready_;
    wanted_ = stage_.exposure(exposure.number + 1, exposure.period_us, exposure.length_us);
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

/// One GigE Vision camera. Aravis calls `fill` from the camera's own thread when an image is due.
class GigeCamera {
 public:
  GigeCamera(const scene::Volume& volume, std::size_t camera, Stage& stage)
      : model_(volume.rig()[camera]), stage_(stage), ahead_(volume, camera, stage) {}
  GigeCamera(const GigeCamera&) = delete;
  GigeCamera& operator=(const GigeCamera&) = delete;
  ~GigeCamera() {
    if (device_ != nullptr) g_object_unref(device_);  // joins its thread, which may still fill
  }

  Status open(const std::string& address, const std::string& serial, const Options& options) {
    device_ = arv_gv_fake_camera_new(address.c_str(), serial.c_str());
    if (device_ == nullptr || !arv_gv_fake_camera_is_running(device_)) {
      return Error{ErrorCode::Busy,
                   fmt::format("camera '{}': cannot serve at {} (UDP port 3956); another camera is simulated there, or "
                               "no interface has this address: try --first-address, or ip addr add {}/8 dev lo",
                               model_.name, address, address)};
    }
    fake_ = arv_gv_fake_camera_get_fake_camera(device_);
    const auto write = [&](std::uint32_t address_of, double value) {
      arv_fake_camera_write_register(fake_, address_of, static_cast<std::uint32_t>(value));
    };
    write(ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, model_.width_px);
    write(ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, model_.height_px);
    write(ARV_FAKE_CAMERA_REGISTER_WIDTH, model_.width_px);
    write(ARV_FAKE_CAMERA_REGISTER_HEIGHT, model_.height_px);
    write(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US, 1e6 / options.rate_hz);
    write(ARV_FAKE_CAMERA_REGISTER_EXPOSURE_TIME_US, options.exposure_us);
    arv_fake_camera_set_fill_pattern(fake_, &GigeCamera::fill, this);
    log_info("camera " + model_.name, fmt::format("served address={} serial={} size={}x{} rate={:.1f}Hz", address,
                                                  serial, model_.width_px, model_.height_px, options.rate_hz));
    return {};
  }

 private:
  static void fill(ArvBuffer* buffer, void* self, guint32 exposure_us, guint32, ArvPixelFormat format) noexcept {
    static_cast<GigeCamera*>(self)->fill(buffer, exposure_us, format);
  }

  std::uint32_t read(std::uint32_t address) const {
    guint32 value = 0;
    arv_fake_camera_read_register(fake_, address, &value);
    return value;
  }

  void fill(ArvBuffer* buffer, std::uint32_t exposure_us, ArvPixelFormat format) noexcept {
    const std::int64_t period_us = std::max(1U, read(ARV_FAKE_CAMERA_REGISTER_ACQUISITION_FRAME_PERIOD_US));
    const std::int64_t number = g_get_real_time() / period_us;
    const Exposure wanted = stage_.exposure(number, period_us, exposure_us);
    const Exposure drawn =
        ahead_.deliver(wanted, [&](const std::vector<std::byte>& pixels) { copy(pixels, buffer, format); });
    arv_buffer_set_frame_id(buffer, static_cast<guint64>(1 + number % 65535));
    arv_buffer_set_timestamp(buffer, static_cast<guint64>(1000 * (number * period_us - std::int64_t{exposure_us})));
    if (!streams_) stage_.streams(drawn);
    streams_ = true;
    stage_.exposed(drawn);
  }

  // The region that the client has chosen; what lies outside of the sensor is black. The buffer does not know its size
  // yet: the registers do.
  void copy(const std::vector<std::byte>& pixels, ArvBuffer* buffer, ArvPixelFormat format) const {
    const std::size_t width = read(ARV_FAKE_CAMERA_REGISTER_WIDTH), height = read(ARV_FAKE_CAMERA_REGISTER_HEIGHT);
    const std::size_t left = read(ARV_FAKE_CAMERA_REGISTER_X_OFFSET), top = read(ARV_FAKE_CAMERA_REGISTER_Y_OFFSET);
    const auto sensor_width = static_cast<std::size_t>(model_.width_px);
    const auto sensor_height = static_cast<std::size_t>(model_.height_px);
    std::size_t size = 0;
    auto* const data = static_cast<std::byte*>(const_cast<void*>(arv_buffer_get_data(buffer, &size)));
    if (data == nullptr) return;
    const bool known = format == ARV_PIXEL_FORMAT_MONO_8 && left < sensor_width;
    const std::size_t shown = known ? std::min(width, sensor_width - left) : 0;
    for (std::size_t y = 0; y < height; ++y) {
      const bool inside = y + top < sensor_height;
      if (inside) std::memcpy(data + y * width, pixels.data() + (y + top) * sensor_width + (known ? left : 0), shown);
      std::memset(data + y * width + (inside ? shown : 0), 0, width - (inside ? shown : 0));
    }
  }

  const CameraModel& model_;
  Stage& stage_;
  Ahead ahead_;
  ArvGvFakeCamera* device_ = nullptr;
  ArvFakeCamera* fake_ = nullptr;
  bool streams_ = false;
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
    cameras.push_back(std::make_unique<GigeCamera>(volume, i, stage));
    const auto opened = cameras.back()->open(address_after(options.first_address, i),
                                             fmt::format("{}{:03}", options.serial_prefix, i + 1), options);
    if (!opened) return opened;
  }
  poll_for_streams(true);

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
  poll_for_streams(false);
  write_exposed();
  return truth.finish();
}

}  // namespace mocap::sim
