// mocapctl bridge list, as a process.
#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"

namespace mocap::ctl {
namespace bridge_command_test {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

class BridgeCommand : public ::testing::Test {
 protected:
  std::string list(const std::string& options = "") const {
    return support::output_of(support::quoted(support::program_folder() + "/mocapctl") + " bridge list --folder " +
                              support::quoted(folder_.path()) + " " + options);
  }

  // The status of a service, as mocap-bridge@NAME writes it.
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories(folder_.path() / name);
    const auto path = folder_.path() / name / "status.json";
    std::ofstream(path) << text;
    return path;
  }

  support::TemporaryFolder folder_;
};

constexpr const char* kVrpn =
    R"({"program":"mocap-vrpn","diagnosis":"data arrives","sent":1200,"dropped":3,"added_p99_us":250.0,)"
    R"("receivers":[{"address":"10.0.0.5:3883","settings":"udp"}]})";

TEST_F(BridgeCommand, NamesTheReceiversOfEachBridge) {
  write("vrpn", kVrpn);

  const std::string text = list();

  EXPECT_THAT(text,
              HasSubstr("mocap-vrpn: 1 receiver, 1200 packets sent, 3 dropped, adds 0.25 ms (p99); data arrives"));
  EXPECT_THAT(text, HasSubstr("10.0.0.5:3883"));
  const auto json = nlohmann::json::parse(list("--json"));
  ASSERT_EQ(json.size(), 1U);
  EXPECT_LT(json[0].at("age_s"), 60.0);
}

TEST_F(BridgeCommand, SaysHowToStartABridgeIfNoneRuns) { EXPECT_THAT(list(), HasSubstr("mocap-bridge@natnet")); }

TEST_F(BridgeCommand, ReportsABridgeThatWritesNoMore) {
  const auto path = write("vrpn", kVrpn);
  std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now() - std::chrono::minutes(2));

  EXPECT_THAT(list(),
              ContainsRegex("mocap-vrpn: no status for (1[2-9]|[2-9][0-9])[0-9] s: the bridge was killed or hangs"));
}

TEST_F(BridgeCommand, LeavesOutFilesThatAreNoStatus) {
  write("torn", "{\"program\": \"mo");
  write("other", "[1, 2]");
  write("numbers", R"({"program":"mocap-x","receivers":[5],"sent":"many"})");

  const std::string text = list();

  EXPECT_THAT(text, HasSubstr("mocap-x: 1 receiver, 0 packets sent"));
  EXPECT_THAT(text, Not(HasSubstr("torn")));
}

}  // namespace bridge_command_test
}  // namespace mocap::ctl
