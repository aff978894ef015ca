#include "cameras/aravis/aravis_chunks.h"

#include <fmt/format.h>
// The C headers of Aravis cause these warnings.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#include <arv.h>
#pragma GCC diagnostic pop

#include <chrono>
#include <cmath>
#include <string_view>

#include "cameras/aravis/aravis_failure.h"

namespace mocap::cameras {
namespace {

constexpr const char* kTimestamp = "Timestamp";
constexpr const char* kExposureTime = "ExposureTime";
constexpr int kMissedForGood = 3;
constexpr double kLongestExposure_us = 10e6;

// Enables the chunk `selector` and returns the feature that has its value; null if the camera does not have it.
ArvGcNode* turned_on(ArvCamera* camera, const char* selector, const char* value) {
  ArvGcNode* const node = arv_device_get_feature(arv_camera_get_device(camera), value);
  if (node == nullptr || !(ARV_IS_GC_INTEGER(node) || ARV_IS_GC_FLOAT(node))) return nullptr;
  AravisFailure failure;
  arv_camera_set_chunk_state(camera, selector, TRUE, failure);
  return failure.happened() ? nullptr : node;
}

// Duration of a tick of the camera's clock, ns. GigE cameras state a frequency; USB cameras count nanoseconds.
double ns_per_tick(ArvCamera* camera) {
  ArvDevice* const device = arv_camera_get_device(camera);
  if (!ARV_IS_GV_DEVICE(device)) return 1.0;
  AravisFailure failure;
  const guint64 ticks = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), failure);
  return failure.happened() || ticks == 0 ? 1.0 : 1e9 / static_cast<double>(ticks);
}

// Exact if a tick is 1 ns: UTC in nanoseconds has more digits than a double.
Duration of_ticks(gint64 ticks, double ns_per_tick) {
  if (ns_per_tick == 1.0) return Duration{ticks};
  return Duration{std::llround(static_cast<long double>(ticks) * static_cast<long double>(ns_per_tick))};
}

}  // namespace

std::unique_ptr<AravisChunks> AravisChunks::turn_on(ArvCamera* camera) {
  AravisFailure failure;
  if (!arv_camera_are_chunks_available(camera, failure) || failure.happened()) return nullptr;
  arv_camera_set_chunk_mode(camera, TRUE, failure);
  if (failure.happened()) return nullptr;
  std::unique_ptr<AravisChunks> chunks(new AravisChunks);
  chunks->timestamp_.node = turned_on(camera, kTimestamp, "ChunkTimestamp");
  chunks->exposure_.node = turned_on(camera, kExposureTime, "ChunkExposureTime");
  chunks->ns_per_tick_ = ns_per_tick(camera);
  if (chunks->timestamp_.node != nullptr && !ARV_IS_GC_INTEGER(chunks->timestamp_.node))
    chunks->timestamp_.node = nullptr;
  if (chunks->timestamp_.node != nullptr || chunks->exposure_.node != nullptr) return chunks;
  turn_off(camera);
  return nullptr;
}

void AravisChunks::turn_off(ArvCamera* camera) {
  if (arv_camera_are_chunks_available(camera, nullptr)) arv_camera_set_chunk_mode(camera, FALSE, nullptr);
}

void AravisChunks::came(Chunk& chunk, bool whole) {
  chunk.missed = whole ? 0 : chunk.missed + 1;
  if (chunk.missed >= kMissedForGood) chunk.node = nullptr;
}

AravisChunks::Values AravisChunks::read(ArvBuffer* buffer) {
  Values values;
  ArvGcNode* const any = timestamp_.node != nullptr ? timestamp_.node : exposure_.node;
  if (any == nullptr) return values;
  const bool there = arv_buffer_has_chunks(buffer) != 0;
  if (there) arv_gc_set_buffer(arv_gc_node_get_genicam(any), buffer);
  if (timestamp_.node != nullptr) {
    AravisFailure failure;
    const gint64 ticks = there ? arv_gc_integer_get_value(ARV_GC_INTEGER(timestamp_.node), failure) : 0;
    if (!failure.happened() && ticks > 0) values.begin = of_ticks(ticks, ns_per_tick_);
    came(timestamp_, values.begin.has_value());
  }
  if (exposure_.node != nullptr) {
    AravisFailure failure;
    double us = 0.0;
    if (there && ARV_IS_GC_FLOAT(exposure_.node)) {
      us = arv_gc_float_get_value(ARV_GC_FLOAT(exposure_.node), failure);
    } else if (there) {
      us = static_cast<double>(arv_gc_integer_get_value(ARV_GC_INTEGER(exposure_.node), failure));
    }
    if (!failure.happened() && us > 0.0 && us < kLongestExposure_us) values.exposure = from_s(us * 1e-6);
    came(exposure_, values.exposure.has_value());
  }
  return values;
}

std::string AravisChunks::names() const {
  const std::string_view both = timestamp_.node != nullptr && exposure_.node != nullptr ? ", " : "";
  return fmt::format("{}{}{}", timestamp_.node != nullptr ? kTimestamp : "", both,
                     exposure_.node != nullptr ? kExposureTime : "");
}

}  // namespace mocap::cameras
