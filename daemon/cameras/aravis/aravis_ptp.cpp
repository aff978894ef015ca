#include "cameras/aravis/aravis_ptp.h"

#include <fmt/format.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

#include "base/log.h"
#include "cameras/aravis/aravis_failure.h"

namespace mocap::cameras {
namespace {

// The election of a master takes two announce intervals, of 2 s each by default.
constexpr Duration kRolePatience = std::chrono::seconds(8);
constexpr Duration kLookAgain = std::chrono::milliseconds(100);
constexpr Duration kWatchEvery = std::chrono::seconds(2);
// PTP in hardware keeps 1 us, in software about 10 us. At 100 us a marker at 5 m/s is displaced by 0.5 mm.
constexpr Duration kFarOff = std::chrono::microseconds(100);

// Names of the features in the standard, and before the standard.
struct Names {
  const char* enable;
  const char* status;
};
constexpr Names kNames[] = {{"PtpEnable", "PtpStatus"}, {"GevIEEE1588", "GevIEEE1588Status"}};

constexpr const char* kUnknown = "unknown";

const Names* names_of(ArvCamera* camera) {
  for (const Names& names : kNames) {
    if (arv_device_get_feature(arv_camera_get_device(camera), names.enable) != nullptr) return &names;
  }
  return nullptr;
}

bool settled(const std::string& role) { return role == "Slave" || role == "Master" || role == "GrandMaster"; }

}  // namespace

std::optional<PtpState> read_ptp(ArvCamera* camera) {
  const Names* const names = names_of(camera);
  if (names == nullptr) return std::nullopt;
  ArvDevice* const device = arv_camera_get_device(camera);
  PtpState state;
  AravisFailure failure;
  state.enabled = arv_device_get_boolean_feature_value(device, names->enable, failure) != 0;
  const char* const role = arv_device_get_string_feature_value(device, names->status, failure);
  state.role = failure.happened() || role == nullptr ? kUnknown : role;
  if (arv_device_get_feature(device, "PtpDataSetLatch") != nullptr) {
    arv_device_execute_command(device, "PtpDataSetLatch", failure);
  }
  if (arv_device_get_feature(device, "PtpOffsetFromMaster") != nullptr) {
    const gint64 offset_ns = arv_device_get_integer_feature_value(device, "PtpOffsetFromMaster", failure);
    if (!failure.happened()) state.offset = Duration{offset_ns};
  }
  return state;
}

std::optional<Duration> read_clock(ArvCamera* camera) {
  ArvDevice* const device = arv_camera_get_device(camera);
  for (const auto& [latch, value] : {std::pair{"TimestampLatch", "TimestampLatchValue"},
                                     std::pair{"GevTimestampControlLatch", "GevTimestampValue"}}) {
    if (arv_device_get_feature(device, latch) == nullptr || arv_device_get_feature(device, value) == nullptr) continue;
    AravisFailure failure;
    arv_device_execute_command(device, latch, failure);
    if (failure.happened()) continue;
    const gint64 shown_ns = arv_device_get_integer_feature_value(device, value, failure);
    if (!failure.happened()) return Duration{shown_ns};
  }
  return std::nullopt;
}

Status enable_ptp(ArvCamera* camera) {
  const Names* const names = names_of(camera);
  if (names == nullptr) {
    return Error{ErrorCode::Unsupported, "ptp = true, but the camera has no PTP (PtpEnable); set ptp = false"};
  }
  AravisFailure failure;
  arv_device_set_boolean_feature_value(arv_camera_get_device(camera), names->enable, TRUE, failure);
  if (failure.happened()) return failure.error(fmt::format("{} = true is refused", names->enable));
  std::optional<PtpState> state = read_ptp(camera);
  for (Duration waited{}; state && !settled(state->role) && waited < kRolePatience; waited += kLookAgain) {
    std::this_thread::sleep_for(kLookAgain);
    state = read_ptp(camera);
  }
  if (!state || !settled(state->role)) {
    return Error{
        ErrorCode::Timeout,
        fmt::format("PTP is enabled, but the camera is {} after {:.0f} s, expected Slave or Master; check that a "
                    "master runs (ptp4l) and that the switch forwards multicast",
                    state ? state->role : "gone", to_s(kRolePatience))};
  }
  const char* const serial = arv_camera_get_device_serial_number(camera, nullptr);
  log_info("camera", fmt::format("{} keeps PTP time: role={} offset={}", serial != nullptr ? serial : "", state->role,
                                 state->offset ? fmt::format("{:.3f}us", to_us(*state->offset)) : "unknown"));
  return {};
}

std::optional<std::string> PtpWatch::follow(const PtpState& state) {
  const bool in_role = state.enabled && settled(state.role);
  const bool near = !state.offset || (*state.offset<kFarOff&& * state.offset> - kFarOff);
  if (std::exchange(well_, in_role && near) == well_) return std::nullopt;
  const std::string offset = state.offset ? fmt::format("{:.3f}us", to_us(*state.offset)) : "unknown";
  if (well_) return fmt::format("keeps PTP time again: role={} offset={}", state.role, offset);
  if (!in_role) {
    return fmt::format(
        "lost PTP time: role={}, expected Slave or Master; exposure times are estimated from the "
        "times of receipt. Check the master (ptp4l) and the link",
        state.enabled ? state.role : "Disabled");
  }
  return fmt::format(
      "PTP clock is off its master's by {}, expected within {:.0f}us; check whether the master was "
      "changed, and the link for other traffic",
      offset, to_us(kFarOff));
}

void watch_ptp(ArvCamera* camera, const std::string& who, std::atomic<bool>& is_well, const std::stop_token& stop) {
  PtpWatch watch;
  std::mutex mutex;
  std::condition_variable_any never_notified;
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    if (const std::optional<PtpState> state = read_ptp(camera); state && state->role != kUnknown) {
      const std::optional<std::string> words = watch.follow(*state);
      is_well = watch.is_well();
      if (words) watch.is_well() ? log_info(who, *words) : log_warn(who, *words);
    }
    never_notified.wait_for(lock, stop, kWatchEvery, [] { return false; });
  }
}

}  // namespace mocap::cameras
