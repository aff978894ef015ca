#include "ctl/doctor.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <optional>

#include "base/list_folder.h"

namespace mocap::ctl {
namespace {

using preflight::good;

namespace fs = std::filesystem;

constexpr std::int64_t kSocketRoom_bytes = 33554432;  // same value and reason as in systemd/60-mocapd.conf
constexpr std::int64_t kBacklog_packets = 5000;
constexpr std::int64_t kUsbRoom_MB = 256;  // four cameras of 5 MP, each with 16 image buffers of 5 MB
constexpr std::int64_t kLargeFrames_bytes = 9000;
constexpr std::int64_t kGigabit_Mb_s = 1000;
constexpr double kLeastDisk_GB = 10.0;

std::optional<std::string> line_of(const fs::path& path) {
  std::string line;
  std::ifstream file(path);
  if (!std::getline(file, line)) return std::nullopt;
  return line;
}

std::optional<std::int64_t> number_of(const fs::path& path) {
  std::int64_t value = 0;
  std::ifstream file(path);
  if (!(file >> value)) return std::nullopt;
  return value;
}

/// Runs all checks. Each member function checks one subject and adds its findings.
class Examination {
 public:
  Examination(const Demands& demands, fs::path root) : demands_(demands), root_(std::move(root)) {}

  std::vector<Finding> run() {
    if (demands_.gige) {
      at_least("net.core.rmem_max", kSocketRoom_bytes, "packets are lost if the receive thread is late");
      at_least("net.core.netdev_max_backlog", kBacklog_packets, "packets are lost between card and socket");
      links();
      raw_sockets();
    }
    if (demands_.usb3) usb();
    if (demands_.v4l2) video();
    permissions();
    clock();
    if (demands_.ptp) ptp();
    processor();
    limits();
    disk();
    return std::move(found_);
  }

 private:
  void at_least(const std::string& sysctl, std::int64_t wanted, const char* else_what) {
    std::string path = sysctl;
    std::replace(path.begin(), path.end(), '.', '/');
    const auto value = number_of(root_ / "proc/sys" / path);
    if (value && *value >= wanted) return found_.push_back(good(sysctl, std::to_string(*value)));
    found_.push_back({sysctl, Verdict::Bad,
                      value ? fmt::format("{}, expected {} or more: {}", *value, wanted, else_what)
                            : "cannot be read; is this Linux?",
                      fmt::format("sysctl -w {}={} && cp systemd/60-mocapd.conf /etc/sysctl.d/", sysctl, wanted)});
  }

  // Checks the physical network cards, without loopback, bridges and other virtual interfaces.
  void links() {
    std::error_code missing;
    std::vector<fs::path> cards;
    for (const fs::path& card : list_folder(root_ / "sys/class/net").paths) {
      if (fs::exists(card / "device", missing)) cards.push_back(card);
    }
    if (cards.empty()) {
      found_.push_back({"network card", Verdict::Warning, "none; only simulated GigE cameras on this machine", {}});
    }
    for (const fs::path& card : cards) link(card);
  }

  void link(const fs::path& card) {
    const std::string name = card.filename().string();
    if (line_of(card / "operstate").value_or("down") != "up") {
      return found_.push_back({"link " + name, Verdict::Warning, "down: no cable, or not configured",
                               fmt::format("ip link set {} up", name)});
    }
    const auto speed = number_of(card / "speed");
    if (speed && *speed > 0 && *speed < kGigabit_Mb_s) {
      found_.push_back({"link " + name, Verdict::Bad,
                        fmt::format("{} Mb/s, expected {} or more; use a cable with four pairs and a gigabit port",
                                    *speed, kGigabit_Mb_s),
                        fmt::format("ethtool -s {} autoneg on && ethtool {}", name, name)});
    } else {
      found_.push_back(good("link " + name, speed && *speed > 0 ? fmt::format("{} Mb/s", *speed) : "speed unknown"));
    }
    const auto mtu = number_of(card / "mtu");
    if (mtu && *mtu >= kLargeFrames_bytes) {
      found_.push_back(good("mtu " + name, std::to_string(*mtu)));
    } else {
      found_.push_back({"mtu " + name, Verdict::Warning,
                        fmt::format("{}; with {}, cameras on this card need a sixth of the processor time",
                                    mtu.value_or(0), kLargeFrames_bytes),
                        fmt::format("ip link set {} mtu {}", name, kLargeFrames_bytes)});
    }
  }

  // Tests the permission of the current user with a real socket, because no file below `root` contains it.
  void raw_sockets() {
    const int handle = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (handle >= 0) close(handle);
    found_.push_back(handle >= 0
                         ? good("packet sockets", "allowed")
                         : Finding{"packet sockets", Verdict::Warning,
                                   "not permitted for this user (the service is permitted): exposure times are "
                                   "estimated from when a thread ran and not from when the kernel received the packet",
                                   "setcap cap_net_raw+ep $(command -v mocapd)"});
  }

  void usb() {
    const auto room = number_of(root_ / "sys/module/usbcore/parameters/usbfs_memory_mb");
    if (!room) return found_.push_back(good("usb", "this kernel has no USB support; USB3 cameras are not possible"));
    if (*room == 0 || *room >= kUsbRoom_MB) return found_.push_back(good("usbfs_memory_mb", std::to_string(*room)));
    found_.push_back({"usbfs_memory_mb", Verdict::Warning,
                      fmt::format("{} MB for all USB3 cameras together, expected {} or more", *room, kUsbRoom_MB),
                      "echo 1000 > /sys/module/usbcore/parameters/usbfs_memory_mb"});
  }

  void video() {
    std::vector<std::string> shut;
    std::size_t nodes = 0;
    for (const fs::path& device : list_folder(root_ / "dev").paths) {
      const std::string name = device.filename().string();
      if (!name.starts_with("video") || name.size() == 5) continue;
      ++nodes;
      if (access(device.c_str(), R_OK | W_OK) != 0) shut.push_back(name);
    }
    if (!shut.empty()) {
      return found_.push_back({"video devices", Verdict::Bad,
                               fmt::format("{} of {} cannot be opened, for example {}", shut.size(), nodes, shut[0]),
                               "usermod -aG video $USER, then log in again"});
    }
    found_.push_back(
        good("video devices", nodes == 0 ? "none is plugged in" : fmt::format("{}, all can be opened", nodes)));
  }

  void permissions() {
    std::error_code missing;
    const bool there = fs::exists(root_ / "etc/udev/rules.d/60-mocapd.rules", missing) ||
                       fs::exists(root_ / "lib/udev/rules.d/60-mocapd.rules", missing);
    if (!demands_.usb3) return;
    if (there) return found_.push_back(good("udev rules", "installed"));
    found_.push_back({"udev rules", Verdict::Warning, "not installed: only root can open USB3 cameras",
                      "cp systemd/60-mocapd.rules /etc/udev/rules.d/ && udevadm control --reload && udevadm trigger"});
  }

  void clock() {
    const std::string source =
        line_of(root_ / "sys/devices/system/clocksource/clocksource0/current_clocksource").value_or("unknown");
    const bool fast = source == "tsc" || source == "kvm-clock" || source == "arch_sys_counter" ||
                      source == "hyperv_clocksource_tsc_page";
    found_.push_back(fast ? good("clock source", source)
                          : Finding{"clock source", Verdict::Warning, source + " is slow to read; tsc takes 20 ns",
                                    "echo tsc > /sys/devices/system/clocksource/clocksource0/current_clocksource"});
    timex now{};
    const bool synchronised = adjtimex(&now) != TIME_ERROR && (now.status & STA_UNSYNC) == 0;
    found_.push_back(synchronised ? good("clock", fmt::format("UTC, within {} us", now.maxerror))
                                  : Finding{"clock", Verdict::Warning, "is not synchronised: UTC times are wrong",
                                            "timedatectl set-ntp true"});
  }

  void ptp() {
    std::error_code missing;
    const bool hardware = fs::exists(root_ / "dev/ptp0", missing);
    found_.push_back(hardware ? good("ptp hardware", "/dev/ptp0")
                              : Finding{"ptp hardware",
                                        Verdict::Warning,
                                        "no /dev/ptp0: PTP uses software time stamps, with errors of about 10 us",
                                        {}});
    found_.push_back(runs("ptp4l") ? good("ptp4l", "runs")
                                   : Finding{"ptp4l", Verdict::Bad,
                                             "does not run: cameras cannot synchronise their clocks with this machine",
                                             "apt-get install linuxptp && systemctl enable --now ptp4l@INTERFACE"});
    found_.push_back(runs("phc2sys") || !hardware
                         ? good("phc2sys", hardware ? "runs" : "not needed without hardware")
                         : Finding{"phc2sys", Verdict::Warning,
                                   "does not run: the clock of this host differs from the cameras' PTP time",
                                   "systemctl enable --now phc2sys@INTERFACE"});
  }

  bool runs(const std::string& program) const {
    const std::vector<fs::path> processes = list_folder(root_ / "proc").paths;
    return std::ranges::any_of(processes, [&](const fs::path& each) { return line_of(each / "comm") == program; });
  }

  void processor() {
    const auto governor = line_of(root_ / "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor");
    if (!governor || *governor == "performance") {
      return found_.push_back(good("processor", governor.value_or("its frequency cannot be set here")));
    }
    found_.push_back({"processor", Verdict::Warning, fmt::format("governor {}: wakes slowly for an image", *governor),
                      "cpupower frequency-set -g performance"});
  }

  void limits() {
    rlimit limit{};
    if (demands_.real_time) {
      const bool may = geteuid() == 0 || (getrlimit(RLIMIT_RTPRIO, &limit) == 0 && limit.rlim_cur > 0);
      found_.push_back(may ? good("real-time priority", "allowed")
                           : Finding{"real-time priority", Verdict::Warning,
                                     "not permitted for this user; the service is permitted",
                                     "echo '@video - rtprio 80' > /etc/security/limits.d/60-mocapd.conf"});
    }
    if (demands_.locked_memory) {
      const bool may = geteuid() == 0 || (getrlimit(RLIMIT_MEMLOCK, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY);
      found_.push_back(may ? good("locked memory", "allowed")
                           : Finding{"locked memory", Verdict::Warning,
                                     "limited for this user; unlimited for the service",
                                     "echo '@video - memlock unlimited' >> /etc/security/limits.d/60-mocapd.conf"});
    }
  }

  void disk() {
    struct statvfs room {};
    if (statvfs(demands_.records_to.c_str(), &room) != 0) {
      return found_.push_back({"disk", Verdict::Bad, fmt::format("{} does not exist", demands_.records_to.string()),
                               fmt::format("mkdir -p {}", demands_.records_to.string())});
    }
    const double free_GB = 1e-9 * static_cast<double>(room.f_bavail) * static_cast<double>(room.f_frsize);
    const std::string text = fmt::format("{:.1f} GB free at {}", free_GB, demands_.records_to.string());
    found_.push_back(free_GB >= kLeastDisk_GB
                         ? good("disk", text)
                         : Finding{"disk", Verdict::Warning, text + "; an hour of takes needs some GB",
                                   "free some space, or set [record] to another disk"});
  }

  const Demands& demands_;
  fs::path root_;
  std::vector<Finding> found_;
};

}  // namespace

std::vector<Finding> examine_machine(const Demands& demands, const fs::path& root) {
  return Examination(demands, root).run();
}

}  // namespace mocap::ctl
