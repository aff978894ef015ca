// Access to a health report through the C ABI.
#include <new>

#include "frame.h"
#include "text.h"

using mocap::client::fill;
using mocap::client::Health;

namespace {

// Copies an entry of one list of a report. Returns 1, or 0 if there is no such entry.
template <typename Entry>
int32_t get(const mocap_health* health, std::vector<Entry> Health::*list, std::size_t index, Entry* into,
            std::size_t size) {
  if (health == nullptr || health->health == nullptr || into == nullptr) return 0;
  const std::vector<Entry>& entries = (*health->health).*list;
  if (index >= entries.size()) return 0;
  fill(into, size, entries[index]);
  return 1;
}

}  // namespace

extern "C" {

mocap_health* mocap_health_new(void) { return new (std::nothrow) mocap_health; }
void mocap_health_free(mocap_health* health) { delete health; }

int32_t mocap_health_get_info(const mocap_health* health, mocap_health_info* into, size_t size) {
  if (health == nullptr || health->health == nullptr || into == nullptr) return 0;
  fill(into, size, health->health->info);
  return 1;
}

int32_t mocap_health_get_camera(const mocap_health* health, size_t index, mocap_camera_health* into, size_t size) {
  return get(health, &Health::cameras, index, into, size);
}

int32_t mocap_health_get_latency(const mocap_health* health, size_t index, mocap_latency* into, size_t size) {
  return get(health, &Health::latencies, index, into, size);
}

int32_t mocap_health_get_recording(const mocap_health* health, size_t index, mocap_recording* into, size_t size) {
  return get(health, &Health::recordings, index, into, size);
}

}  // extern "C"
