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

/// What the command line asks for.
struct Options {
  std::string motion = "tpose:2,walk";
  std::filesystem::path marker_set;  ///< empty: openmocap18, and for a BVH its own joints
  double bvh_unit_m = 0.0;           ///< 0: so that the body is of usual height
  double t_pose_s = 2.0;             ///< before a BVH begins

  std::filesystem::path rig;  ///< empty: the ring
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
  std::vector<std::string> v4l2;  ///< devices of v4l2loopback, one a camera
  std::string v4l2_format = "MJPEG";
  std::filesystem::path folders;
  double seconds = 0.0;  ///< 0: until told to end
  std::string first_address = "127.0.0.2";
  std::string serial_prefix = "SIM";
  std::optional<int> only;  ///< serve this camera of the rig alone, from 1
  // What real cameras and networks do to images. Skew and drift are of each camera's own clock, of the odd ones (from
  // 1) forwards and of the others backwards.
  double clock_skew_us = 0.0;
  double clock_drift_ppm = 0.0;
  double delivery_jitter_us = 0.0;  ///< mean of an exponential delay
  double packet_loss = 0.0;         ///< share of the packets
  bool no_resend = false;
  int skip_every = 0, repeat_every = 0, silent_after = 0;  ///< images; 0: never
  int loop_images = 0;                                     ///< drawn beforehand and shown to and fro; 0: each is drawn
  bool start_on_stream = true;
  std::optional<std::int64_t> epoch_ns;  ///< the motion begins there on CLOCK_MONOTONIC
};

/// What to do: the options, or the exit code with which the program ends at once (--help, a wrong command line).
struct CommandLine {
  Options options;
  std::optional<int> exit;
};

CommandLine read_command_line(int argc, char** argv);

}  // namespace mocap::sim
