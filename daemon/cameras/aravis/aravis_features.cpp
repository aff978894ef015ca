#include "cameras/aravis/aravis_features.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cameras/aravis/action_trigger.h"
#include "cameras/aravis/aravis_failure.h"

namespace mocap::cameras {
namespace {

constexpr const char* kSoftware = "software";  // value of AravisSettings::trigger
constexpr const char* kAction = "action";

std::optional<PixelFormat> pixel_format_of(ArvPixelFormat format) {
  constexpr ArvPixelFormat kMono10p = 0x010a0046;  // GenICam PFNC 2.4
  constexpr ArvPixelFormat kMono12p = 0x010c0047;
  switch (format) {
    case ARV_PIXEL_FORMAT_MONO_8: return PixelFormat::Mono8;
    case ARV_PIXEL_FORMAT_MONO_10: return PixelFormat::Mono10;
    case ARV_PIXEL_FORMAT_MONO_12: return PixelFormat::Mono12;
    case kMono10p: return PixelFormat::Mono10p;
    case kMono12p: return PixelFormat::Mono12p;
    case ARV_PIXEL_FORMAT_MONO_10_PACKED: return PixelFormat::Mono10Packed;
    case ARV_PIXEL_FORMAT_MONO_12_PACKED: return PixelFormat::Mono12Packed;
    case ARV_PIXEL_FORMAT_BAYER_GR_8: return PixelFormat::BayerGr8;
    case ARV_PIXEL_FORMAT_BAYER_RG_8: return PixelFormat::BayerRg8;
    case ARV_PIXEL_FORMAT_BAYER_GB_8: return PixelFormat::BayerGb8;
    case ARV_PIXEL_FORMAT_BAYER_BG_8: return PixelFormat::BayerBg8;
    default: return std::nullopt;
  }
}

Result<PixelFormat> set_pixel_format(ArvCamera* camera, const AravisSettings& settings) {
  AravisFailure failure;
  if (!settings.pixel_format.empty()) {
    arv_camera_set_pixel_format_from_string(camera, settings.pixel_format.c_str(), failure);
  }
  if (failure.happened()) {
    guint count = 0;
    const char** names = arv_camera_dup_available_pixel_formats_as_strings(camera, &count, nullptr);
    std::string offered;
    for (guint i = 0; i < count; ++i) offered += fmt::format("{}{}", i == 0 ? "" : ", ", names[i]);
    g_free(names);
    return Error{ErrorCode::Unsupported, fmt::format("pixel_format {} is refused ({}); the camera offers {}",
                                                     settings.pixel_format, failure.text(), offered)};
  }
  const std::optional<PixelFormat> known = pixel_format_of(arv_camera_get_pixel_format(camera, failure));
  if (failure.happened()) return failure.error("cannot read the pixel format");
  if (!known) {
    return Error{ErrorCode::Unsupported, fmt::format("pixel_format {} is not understood; use Mono8, Mono10, Mono12, "
                                                     "Mono10p, Mono12p, Mono10Packed, Mono12Packed or Bayer 8",
                                                     settings.pixel_format)};
  }
  return *known;
}

Status set_region(ArvCamera* camera, const AravisSettings& settings) {
  if (!settings.x_px && !settings.y_px && !settings.width_px && !settings.height_px) return {};
  AravisFailure failure;
  int x = 0, y = 0, width = 0, height = 0;
  arv_camera_get_region(camera, &x, &y, &width, &height, failure);
  if (failure.happened()) return failure.error("cannot read the region");
  const int wanted[] = {settings.x_px.value_or(x), settings.y_px.value_or(y), settings.width_px.value_or(width),
                        settings.height_px.value_or(height)};
  arv_camera_set_region(camera, wanted[0], wanted[1], wanted[2], wanted[3], failure);
  const std::string refusal = failure.happened() ? ": " + failure.text() : "";
  arv_camera_get_region(camera, &x, &y, &width, &height, failure);
  if (failure.happened()) return failure.error("cannot read the region");
  int sensor_width = 0, sensor_height = 0;
  arv_camera_get_sensor_size(camera, &sensor_width, &sensor_height, failure);
  const bool inside = failure.happened() || (x + width <= sensor_width && y + height <= sensor_height);
  if (refusal.empty() && inside && std::equal(wanted, wanted + 4, std::array{x, y, width, height}.begin())) return {};
  return Error{
      ErrorCode::InvalidArgument,
      fmt::format("region {}x{} at ({}, {}) is refused, the camera has {}x{} at ({}, {}) on a sensor of {}x{}{}",
                  wanted[2], wanted[3], wanted[0], wanted[1], width, height, x, y, sensor_width, sensor_height,
                  refusal)};
}

// A numeric feature with the functions of Aravis that set it, read it and read its range.
struct Number {
  const char* name;
  void (*set)(ArvCamera*, double, GError**);
  double (*get)(ArvCamera*, GError**);
  void (*bounds)(ArvCamera*, double*, double*, GError**);
};
constexpr Number kRate{"rate_hz", arv_camera_set_frame_rate, arv_camera_get_frame_rate,
                       arv_camera_get_frame_rate_bounds};
constexpr Number kExposure{"exposure_us", arv_camera_set_exposure_time, arv_camera_get_exposure_time,
                           arv_camera_get_exposure_time_bounds};
constexpr Number kGain{"gain_db", arv_camera_set_gain, arv_camera_get_gain, arv_camera_get_gain_bounds};

Status set_number(ArvCamera* camera, const Number& number, double value) {
  AravisFailure failure;
  number.set(camera, value, failure);
  if (failure.happened()) return failure.error(fmt::format("{} = {} is refused", number.name, value));
  const double taken = number.get(camera, failure);
  if (failure.happened()) return failure.error(fmt::format("cannot read back {}", number.name));
  // Cameras round to their own steps. A difference of more than 2 % is not rounding.
  if (std::abs(taken - value) <= std::max(0.02 * std::abs(value), 0.1)) return {};
  double least = 0.0, most = 0.0;
  number.bounds(camera, &least, &most, nullptr);
  return Error{ErrorCode::InvalidArgument,
               fmt::format("{} is {}, the camera took {}; expected {} to {}", number.name, value, taken, least, most)};
}

std::vector<std::string> trigger_sources(ArvCamera* camera) {
  guint count = 0;
  const char** names = arv_camera_dup_available_trigger_sources(camera, &count, nullptr);
  std::vector<std::string> sources(names, names + count);
  g_free(names);
  return sources;
}

Status set_integer(ArvCamera* camera, const char* feature, gint64 value) {
  AravisFailure failure;
  arv_device_set_integer_feature_value(arv_camera_get_device(camera), feature, value, failure);
  return failure.happened() ? Status(failure.error(fmt::format("feature {} = {} is refused", feature, value)))
                            : Status{};
}

// Selects the first action that the camera has and sets its keys. The camera's own frame rate limit is switched off: it
// would ignore commands that arrive a little early.
Status set_action(ArvCamera* camera, const AravisSettings& settings) {
  if (!settings.rate_hz) return Error{ErrorCode::InvalidArgument, "trigger = \"action\" needs rate_hz"};
  const std::vector<std::string> sources = trigger_sources(camera);
  const auto action = std::ranges::find_if(sources, [](const std::string& each) { return each.starts_with("Action"); });
  if (!arv_camera_is_gv_device(camera) || action == sources.end()) {
    return Error{
        ErrorCode::Unsupported,
        fmt::format("trigger = \"action\": the camera does not accept action commands (GigE Vision 2); it offers {}",
                    fmt::join(sources, ", "))};
  }
  AravisFailure failure;
  arv_camera_set_trigger(camera, action->c_str(), failure);
  if (failure.happened()) return failure.error(fmt::format("trigger {} is refused", *action));
  arv_camera_set_boolean(camera, "AcquisitionFrameRateEnable", FALSE, nullptr);  // many cameras do not have the feature
  const gint64 number = std::atoi(action->c_str() + std::string_view("Action").size());
  for (const auto& [feature, value] : {std::pair<const char*, gint64>{"ActionDeviceKey", kActionDeviceKey},
                                       {"ActionSelector", number},
                                       {"ActionGroupKey", kActionGroupKey},
                                       {"ActionGroupMask", kActionGroupMask}}) {
    if (Status set = set_integer(camera, feature, value); !set) return set;
  }
  return {};
}

Status set_trigger(ArvCamera* camera, const AravisSettings& settings) {
  if (settings.trigger == kAction) return set_action(camera, settings);
  AravisFailure failure;
  if (settings.trigger == "free_run") {
    arv_camera_clear_triggers(camera, nullptr);  // fails on cameras without triggers, which run free anyway
    return {};
  }
  arv_camera_set_trigger(camera, settings.trigger == kSoftware ? "Software" : settings.trigger.c_str(), failure);
  if (!failure.happened()) return {};
  const std::vector<std::string> offered = trigger_sources(camera);
  return Error{ErrorCode::Unsupported,
               fmt::format("trigger {} is refused ({}); the camera offers {}", settings.trigger, failure.text(),
                           offered.empty() ? "none" : fmt::format("{}", fmt::join(offered, ", ")))};
}

Status set_transport(ArvCamera* camera, const AravisSettings& settings) {
  if (!arv_camera_is_gv_device(camera)) return {};
  arv_camera_gv_set_stream_options(
      camera, settings.packet_socket ? ARV_GV_STREAM_OPTION_NONE : ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  if (!settings.packet_size_bytes) {  // the stream negotiates the largest size that arrives
    arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_ALWAYS);
    return {};
  }
  AravisFailure failure;
  arv_camera_gv_set_packet_size_adjustment(camera, ARV_GV_PACKET_SIZE_ADJUSTMENT_NEVER);
  arv_camera_gv_set_packet_size(camera, *settings.packet_size_bytes, failure);
  if (failure.happened())
    return failure.error(fmt::format("packet_size_bytes = {} is refused", *settings.packet_size_bytes));
  return {};
}

// Each feature is written and read back before the next, because a feature may be the selector of the next.
Status set_feature(ArvCamera* camera, const Feature& feature) {
  const auto& [name, value] = feature;
  ArvGcNode* const node = arv_device_get_feature(arv_camera_get_device(camera), name.c_str());
  if (node == nullptr || !ARV_IS_GC_FEATURE_NODE(node)) {
    return Error{ErrorCode::Unsupported,
                 fmt::format("the camera has no feature {}; mocapctl cameras describe lists what it has", name)};
  }
  AravisFailure failure;
  if (ARV_IS_GC_COMMAND(node)) {
    arv_gc_command_execute(ARV_GC_COMMAND(node), failure);
    return failure.happened() ? Status(failure.error(fmt::format("feature {} cannot be executed", name))) : Status{};
  }
  arv_gc_feature_node_set_value_from_string(ARV_GC_FEATURE_NODE(node), value.c_str(), failure);
  if (failure.happened()) return failure.error(fmt::format("feature {} = {} is refused", name, value));
  const char* const read = arv_gc_feature_node_get_value_as_string(ARV_GC_FEATURE_NODE(node), failure);
  const std::string taken = read != nullptr ? read : "";
  if (failure.happened() || taken == value) return {};  // some features are write-only
  double wanted = 0.0, got = 0.0;
  const bool numbers = std::sscanf(value.c_str(), "%lf", &wanted) == 1 && std::sscanf(taken.c_str(), "%lf", &got) == 1;
  if (numbers && std::abs(got - wanted) <= std::max(0.02 * std::abs(wanted), 1e-9)) return {};
  return Error{ErrorCode::InvalidArgument, fmt::format("feature {} is {}, the camera has {}", name, value, taken)};
}

// A camera that lowers its rate for a long exposure reports the lower rate, so the check succeeds.
Status check_period(ArvCamera* camera, double exposure_us) {
  AravisFailure failure;
  const double rate_hz = arv_camera_get_frame_rate(camera, failure);
  if (failure.happened() || rate_hz <= 0.0 || exposure_us <= 1e6 / rate_hz) return {};
  return Error{ErrorCode::InvalidArgument,
               fmt::format("its exposure of {:.0f} us is longer than the period of {:.0f} us at {:.1f} Hz; set "
                           "exposure_us lower, or rate_hz",
                           exposure_us, 1e6 / rate_hz, rate_hz)};
}

Status set_numbers(ArvCamera* camera, const AravisSettings& settings) {
  if (settings.rate_hz) {
    if (Status set = set_number(camera, kRate, *settings.rate_hz); !set) return set;
  }
  if (settings.exposure_us) {
    arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, nullptr);  // many cameras have no automatic exposure
    if (Status set = set_number(camera, kExposure, *settings.exposure_us); !set) return set;
  }
  if (settings.gain_db) {
    arv_camera_set_gain_auto(camera, ARV_AUTO_OFF, nullptr);
    if (Status set = set_number(camera, kGain, *settings.gain_db); !set) return set;
  }
  return {};
}

}  // namespace

Result<AravisFeatures> apply_settings(ArvCamera* camera, const AravisSettings& settings) {
  // Another program may have ended without a stop. The call fails on an idle camera.
  arv_camera_stop_acquisition(camera, nullptr);
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, nullptr);  // most cameras have no other mode
  const Result<PixelFormat> format = set_pixel_format(camera, settings);
  if (!format) return format.error();
  if (const Status set = set_region(camera, settings); !set) return set.error();
  if (const Status set = set_numbers(camera, settings); !set) return set.error();
  AravisFailure failure;
  const double exposure_us = arv_camera_get_exposure_time(camera, failure);
  const Duration exposure = failure.happened() ? Duration::zero() : from_s(exposure_us * 1e-6);
  if (settings.trigger == "free_run" || settings.trigger == kAction) {
    if (const Status fits = check_period(camera, to_us(exposure)); !fits) return fits.error();
  }
  if (const Status set = set_trigger(camera, settings); !set) return set.error();
  if (const Status set = set_transport(camera, settings); !set) return set.error();
  for (const Feature& feature : settings.features) {
    if (const Status set = set_feature(camera, feature); !set) return set.error();
  }
  AravisFeatures features{*format, exposure, settings.trigger == kSoftware, std::nullopt};
  // Whole microseconds, the unit in which simulated cameras count their periods.
  if (settings.trigger == kAction) {
    features.action_period = std::chrono::microseconds(static_cast<std::int64_t>(1e6 / *settings.rate_hz));
  }
  return features;
}

}  // namespace mocap::cameras
