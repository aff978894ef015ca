#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"

namespace mocap::bench {

struct CamerasBenchSettings {
  std::string bus = "gige";  ///< gige: served by mocap-sim on loopback; v4l2: /dev/video0, /dev/video1, ...
  int count = 8;
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 120.0;
  double seconds = 10.0;
  double warm_up_s = 1.0;  ///< time between the first image of every camera and the measurement
  // Options of mocap-sim for the served cameras.
  std::string trigger = "free_run";  ///< free_run or action, at the same rate
  bool ptp = false;
  double clock_skew_us = 0.0;
  double clock_drift_ppm = 0.0;
  double delivery_jitter_us = 0.0;
  double packet_loss = 0.0;
  std::string clock = "estimated";
  int packet_size_bytes = 8000;
  double patience_us = 0.0;          ///< 0: default of the daemon
  std::string pixel_format;          ///< empty: default of the bus
  std::filesystem::path marker_set;  ///< of the simulated subject
};

struct CamerasBenchFigures {
  std::uint64_t sets = 0;
  double complete_share = 0.0;    ///< complete sets / expected sets
  std::uint64_t passed_over = 0;  ///< sets skipped because a newer set was ready
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;     ///< images that were missing, incomplete or dropped at a full queue
  double frames_share = 0.0;  ///< frames / expected frames
  std::uint64_t resent_packets = 0;
  std::uint64_t missing_packets = 0;
  // Share of one processor, for each camera.
  double receive_cpu_share = 0.0;  ///< receive thread of Aravis; with v4l2 included in detect_cpu_share
  double detect_cpu_share = 0.0;   ///< camera thread: detection and 2D tracks
  double daemon_cpu_share = 0.0;   ///< all threads, divided by the number of cameras
  double load = 0.0;               ///< load average of the machine before the measurement
  // Errors of the exposure time (middle of the exposure). Absent if the truth is unknown.
  std::optional<double> time_error_us;   ///< rms
  std::optional<double> time_offset_us;  ///< mean; includes the constant minimum delay
  std::optional<double> apart_us;        ///< rms deviation of the cameras from the mean of their set
};

/// Runs the whole daemon in this process, from packet to feed, on cameras served in a separate network namespace. Fails
/// with Unsupported if the system does not allow the namespace or has no cameras of this bus.
Result<CamerasBenchFigures> run_cameras_bench(const CamerasBenchSettings& settings);

}  // namespace mocap::bench
