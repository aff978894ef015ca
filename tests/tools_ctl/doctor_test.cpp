#include "ctl/doctor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace doctor_test {

namespace fs = std::filesystem;
using testing::HasSubstr;

// A folder with the /proc, /sys and /etc files of a machine.
struct Machine {
  support::TemporaryFolder folder;

  void has(const fs::path& path, const std::string& text) const {
    const fs::path whole = folder.path() / path;
    fs::create_directories(whole.parent_path());
    std::ofstream(whole) << text << '\n';
  }
  Finding finding(const std::string& check, const Demands& demands = {}) const {
    for (const Finding& each : examine_machine(demands, folder.path())) {
      if (each.check == check) return each;
    }
    return {"no such check: " + check, Verdict::Good, {}, {}};
  }
};

TEST(Doctor, ReportsTheSysctlThatEnlargesTheSocketBuffer) {
  Machine machine;
  machine.has("proc/sys/net/core/rmem_max", "212992");

  const Finding small = machine.finding("net.core.rmem_max");
  machine.has("proc/sys/net/core/rmem_max", "33554432");
  const Finding enough = machine.finding("net.core.rmem_max");

  EXPECT_EQ(small.verdict, Verdict::Bad);
  EXPECT_THAT(small.what, HasSubstr("212992, expected 33554432"));
  EXPECT_THAT(small.cure, HasSubstr("sysctl -w net.core.rmem_max=33554432"));
  EXPECT_EQ(enough.verdict, Verdict::Good);
  EXPECT_EQ(enough.cure, "");
}

TEST(Doctor, ChecksSpeedAndMtuOfEachCardExceptLoopback) {
  Machine machine;
  machine.has("sys/class/net/lo/mtu", "65536");
  machine.has("sys/class/net/eth0/device/vendor", "0x8086");
  machine.has("sys/class/net/eth0/operstate", "up");
  machine.has("sys/class/net/eth0/speed", "100");
  machine.has("sys/class/net/eth0/mtu", "1500");
  machine.has("sys/class/net/eth1/device/vendor", "0x8086");
  machine.has("sys/class/net/eth1/operstate", "down");

  EXPECT_EQ(machine.finding("link eth0").verdict, Verdict::Bad);
  EXPECT_THAT(machine.finding("mtu eth0").cure, HasSubstr("ip link set eth0 mtu 9000"));
  EXPECT_THAT(machine.finding("link eth1").what, HasSubstr("down"));
  EXPECT_THAT(machine.finding("mtu lo").check, HasSubstr("no such check"));
}

TEST(Doctor, RequiresPtpOnlyIfCamerasUseIt) {
  Machine machine;
  machine.has("proc/17/comm", "bash");
  EXPECT_THAT(machine.finding("ptp4l").check, HasSubstr("no such check"));

  EXPECT_EQ(machine.finding("ptp4l", {.ptp = true}).verdict, Verdict::Bad);
  machine.has("proc/18/comm", "ptp4l");
  EXPECT_EQ(machine.finding("ptp4l", {.ptp = true}).verdict, Verdict::Good);
}

TEST(Doctor, ChecksUdevRulesClockSourceAndUsbMemory) {
  Machine machine;
  machine.has("sys/module/usbcore/parameters/usbfs_memory_mb", "16");
  machine.has("sys/devices/system/clocksource/clocksource0/current_clocksource", "hpet");

  EXPECT_EQ(machine.finding("usbfs_memory_mb").verdict, Verdict::Warning);
  EXPECT_EQ(machine.finding("udev rules").verdict, Verdict::Warning);
  EXPECT_THAT(machine.finding("clock source").what, HasSubstr("hpet"));
  machine.has("etc/udev/rules.d/60-mocapd.rules", "");
  machine.has("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
  EXPECT_EQ(machine.finding("udev rules").verdict, Verdict::Good);
  EXPECT_EQ(machine.finding("clock source").verdict, Verdict::Good);
}

TEST(Doctor, ProposesARemedyForEachBadFinding) {
  const Machine machine;
  for (const Finding& each : examine_machine({.ptp = true, .records_to = "/no/such/folder"}, machine.folder.path())) {
    if (each.verdict != Verdict::Bad) continue;
    EXPECT_FALSE(each.cure.empty()) << each.check;
  }
}

}  // namespace doctor_test
}  // namespace mocap::ctl
