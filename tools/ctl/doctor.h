#pragma once

#include <filesystem>
#include <vector>

#include "lib/preflight/finding.h"

namespace mocap::ctl {

using preflight::Finding;
using preflight::Verdict;

/// The features that the machine must support.
struct Demands {
  bool gige = true;  ///< GigE Vision cameras
  bool usb3 = true;  ///< USB3 Vision cameras
  bool v4l2 = true;  ///< V4L2 cameras
  bool ptp = false;
  bool real_time = true;  ///< threads with SCHED_FIFO
  bool locked_memory = true;
  std::filesystem::path records_to = ".";  ///< folder of the takes
};

/// Checks the machine. `root`: folder that contains /proc, /sys, /etc and /dev; tests use a copy.
std::vector<Finding> examine_machine(const Demands& demands, const std::filesystem::path& root = "/");

}  // namespace mocap::ctl
