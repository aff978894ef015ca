#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/render.h"
#include "scene/ring_rig.h"

namespace mocap::sim {

/// Number of images of a loop if --loop-images is 0.
inline constexpr int kUsualLoop = 8;

/// Options of the command line.
struct Options {
  std::string motion = "tpose:2,walk";
  std::filesystem::path marker_set;  ///< empty: openmocap18, or the joints of a BVH
  double bvh_unit_m = 0.0;           ///< 0: scale the body to a height of 1.75 m
  double t_pose_s = 2.0;             ///< duration of the T-pose before a BVH motion

  std::filesystem::path rig;  ///< empty: use `ring`
  scene::Ring ring;
  std::array<int, 2> size_px{640, 480};
  double hfov_deg = 65.0;
  std::filesystem::path write_rig;
  std::filesystem::path write_truth;

  scene::ImageSettings image;
  double rate_hz = 60.0;
  double exposure_us = 500.0;
  double marker_diameter_mm = 15.0;
  bool no_occlusion = false;

  bool serve = false;
  bool usb3 = false;
  bool usb_one_controller = false;
  std::vector<std::string> v4l2;  ///< v4l2loopback devices, one for each camera
  std::string v4l2_format = "MJPEG";
  std::filesystem::path folders;
  double seconds = 0.0;  ///< 0: until SIGTERM
  std::string first_address = "127.0.0.2";
  std::string serial_prefix = "SIM";
  std::optional<int> only;  ///< serve only this camera of the rig, from 1
  // Faults of cameras and networks. Skew and drift apply to each camera clock: positive for cameras 1, 3, ..., negative
  // for the others.
  double clock_skew_us = 0.0;
  double clock_drift_ppm = 0.0;
  double delivery_jitter_us = 0.0;  ///< mean of an exponential delay
  double packet_loss = 0.0;         ///< share of the packets
  bool no_resend = false;
  int skip_every = 0, repeat_every = 0, silent_after = 0;  ///< number of images; 0: never
  int loop_images = 0;                                     ///< images drawn in advance; 0: draw each image
  bool start_on_stream = true;
  std::optional<std::int64_t> epoch_ns;  ///< start of the motion on CLOCK_MONOTONIC
};

/// The options, or the exit code if the program must end immediately (--help, an invalid command line).
struct CommandLine {
  Options options;
  std::optional<int> exit;
};

CommandLine read_command_line(int argc, char** argv);

}  // namespace mocap::sim
