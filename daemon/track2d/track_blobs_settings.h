#pragma once

#include <chrono>
#include <cstdint>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::track2d {

enum class TrackMethod { AlphaBeta, AdaptiveAlphaBeta, Kalman, Condensation };

/// [track]: 2D tracks in the images of one camera, the settings of all methods. Help, units and ranges: the table in
/// track_blobs_settings.cpp.
struct TrackBlobsSettings {
  TrackMethod method = TrackMethod::Kalman;
  double gate_sigmas = 4.0;
  double gate_floor_px = 2.0;
  double gate_per_speed = 0.5;
  double gate_growth_px_s = 300.0;
  std::uint32_t confirm_images = 3;
  Duration max_coast = std::chrono::milliseconds(1500);
  double acceleration_px_s2 = 4000.0;
  double initial_speed_px_s = 400.0;
  double alpha = 0.9;
  double beta = 0.8;
  double alpha_beta_gate_px = 10.0;
  int particles = 100;
  std::uint64_t seed = 1;
};

void declare_keys(KeyVisitor& keys, TrackBlobsSettings& track);

}  // namespace mocap::track2d
