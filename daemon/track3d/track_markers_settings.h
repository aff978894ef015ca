#pragma once

#include <chrono>
#include <cstdint>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::track3d {

/// [track_markers]: 3D tracks in the volume. Help, units and ranges: the table in track_markers_settings.cpp.
struct TrackMarkersSettings {
  double gate_sigmas = 4.0;
  double gate_floor_m = 0.004;
  double gate_per_speed = 0.1;
  std::uint32_t confirm_sets = 3;
  Duration max_coast = std::chrono::milliseconds(500);
  double max_coast_sigma_m = 0.15;
  double acceleration_m_s2 = 5.0;
  double acceleration_per_speed_1_s = 6.0;
  double max_noise_scale = 25.0;
  double initial_speed_m_s = 2.0;
  Duration coast_half_life = std::chrono::milliseconds(200);
  double sighting_floor_m = 0.00002;
};

void declare_keys(KeyVisitor& keys, TrackMarkersSettings& track);

}  // namespace mocap::track3d
