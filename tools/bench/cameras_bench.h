#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"

namespace mocap::bench {

struct CamerasBenchSettings {
  std::string bus = "gige";  ///< gige: served by mocap-sim on loopback; v4l2: /dev/video0 and on
  int count = 8;
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 120.0;
  double seconds = 10.0;
  double warm_up_s = 1.0;  ///< after every camera streams
  // Of the served cameras, as mocap-sim has them.
  std::string trigger = "free_run";  ///< or action, at the same rate
  bool ptp = false;
  double clock_skew_us = 0.0;
  double clock_drift_ppm = 0.0;
  double delivery_jitter_us = 0.0;
  double packet_loss = 0.0;
  std::string clock = "estimated";
  int packet_size_bytes = 8000;
  double patience_us = 0.0;          ///< 0: the daemon's own
  std::string pixel_format;          ///< empty: the bus's usual one
  std::filesystem::path marker_set;  ///< worn by the simulated subject
};

struct CamerasBenchFigures {
  std::uint64_t sets = 0;
  double complete_share = 0.0;    ///< complete sets, of those that there should have been
  std::uint64_t passed_over = 0;  ///< sets, since a newer one waited
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;     ///< images that never came, came broken or found no room
  double frames_share = 0.0;  ///< frames, of those that there should have been
  std::uint64_t resent_packets = 0;
  std::uint64_t missing_packets = 0;
  // Of one processor, for each camera.
  double receive_cpu_share = 0.0;  ///< Aravis's thread; with v4l2, in detect_cpu_share
  double detect_cpu_share = 0.0;   ///< the camera's thread: detection, 2D tracks
  double daemon_cpu_share = 0.0;   ///< all threads, shared by the cameras
  double load = 0.0;               ///< processes that wanted a processor, before
  // Of the middle of the exposure; absent where nobody knows the truth.
  std::optional<double> time_error_us;   ///< rms
  std::optional<double> time_offset_us;  ///< mean: the least delay is in it
  std::optional<double> apart_us;        ///< rms of the cameras about their set's mean
};

/// Runs the whole daemon in this process on served cameras, in a network of its own, from packet to feed. Fails with
/// Unsupported where the system gives no such network, or no cameras of this bus.
Result<CamerasBenchFigures> run_cameras_bench(const CamerasBenchSettings& settings);

}  // namespace mocap::bench
