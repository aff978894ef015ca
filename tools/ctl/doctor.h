#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace mocap::ctl {

enum class Verdict { Good, Warning, Bad };

/// One thing looked at: how it is, and what mends it.
struct Finding {
  std::string check;  ///< "net.core.rmem_max"
  Verdict verdict = Verdict::Good;
  std::string what;
  std::string cure;  ///< a command, or nothing
};

/// What the machine is asked for.
struct Demands {
  bool gige = true;  ///< cameras on the network
  bool usb3 = true;  ///< USB3 Vision cameras
  bool v4l2 = true;  ///< cameras of the kernel
  bool ptp = false;
  bool real_time = true;  ///< threads of SCHED_FIFO
  bool locked_memory = true;
  std::filesystem::path records_to = ".";
};

/// Looks at the machine below `root` (/proc, /sys, /etc, /dev), which is / but in tests.
std::vector<Finding> examine_machine(const Demands& demands, const std::filesystem::path& root = "/");

}  // namespace mocap::ctl
