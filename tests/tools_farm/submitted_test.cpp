#include "lib/farm/submitted.h"

#include <gmock/gmock.h>

#include <map>

#include "support/temporary_folder.h"

namespace mocap::farm {
namespace submitted_test {

using ::testing::HasSubstr;
using Kind = UnitResult::Kind;

// Systems that run units are shell scripts here; the real ones are in tests/system/retrack_farm_test.py.
class SubmittedUnits : public testing::Test {
 protected:
  SubmittedUnits() {
    order_.folder = folder_.path();
    for (const char* name : {"a", "b", "c"})
      order_.units.push_back({std::string("/") + name + ".mcap", "/new.mcap", 1});
    watch_.progress = [this](const FarmProgress& now) {
      progress_ = now;
      if (on_progress_) on_progress_();
    };
    watch_.ended = [this](const Unit& unit, const UnitResult& result) { results_[unit.take.stem().string()] = result; };
    watch_.stops = [this] { return stops_; };
  }

  Result<std::size_t> run(const std::string& script, bool cancels_jobs = false) {
    const Submission submission{.files = {},
                                .command = {"bash", "-c", "cd '" + folder_.path().string() + "'; " + script},
                                .cancels_jobs = cancels_jobs};
    return run_submitted(order_, submission, watch_);
  }

  support::TemporaryFolder folder_;
  FarmOrder order_;
  FarmWatch watch_;
  FarmProgress progress_;
  std::function<void()> on_progress_;
  int stops_ = 0;
  std::map<std::string, UnitResult> results_;
};

TEST_F(SubmittedUnits, AreReadFromTheirFiles) {
  const auto left = run(R"(for i in 0 1; do echo '{"sets": 7}' >$i.log; echo 0 >$i.exit; done
echo "mocapctl: is bad" >2.log; echo 65 >2.exit; exit 1)");

  ASSERT_TRUE(left) << left.error().message;
  EXPECT_EQ(*left, 0U);
  EXPECT_EQ(results_["a"].kind, Kind::Tracked);
  EXPECT_EQ(results_["b"].report.at("sets"), 7);
  EXPECT_EQ(results_["c"].kind, Kind::Failed);
  EXPECT_EQ(results_["c"].exit_code, 65);
  EXPECT_THAT(results_["c"].reason, HasSubstr("is bad (log: " + (folder_.path() / "2.log").string()));
  EXPECT_EQ(progress_.ended, 3U);
}

TEST_F(SubmittedUnits, AUnitWithoutAnEndIsAFailure) {
  const auto left = run(R"(echo "Submitted batch job 12"; echo '{"sets": 7}' >0.log; echo 0 >0.exit)");

  ASSERT_TRUE(left);
  EXPECT_EQ(results_["a"].kind, Kind::Tracked);
  EXPECT_EQ(results_["b"].kind, Kind::Failed);
  EXPECT_THAT(results_["b"].reason, HasSubstr("element 1 of job 12 did not end"));
  EXPECT_NE(results_["c"].exit_code, 0);
}

TEST_F(SubmittedUnits, ACommandThatTheUsersSignalEndedFirstIsAStopAndNoFault) {
  stops_ = 1;

  const auto left = run("kill -INT $$");

  ASSERT_TRUE(left) << left.error().message;
  EXPECT_EQ(*left, 3U);
  EXPECT_TRUE(results_.empty());
}

TEST_F(SubmittedUnits, ExitCodesOfAnEarlierRunAreForgotten) {
  folder_.write("0.exit", "0\n");

  const auto left = run("true");

  ASSERT_TRUE(left);
  EXPECT_EQ(results_["a"].kind, Kind::Failed);
}

TEST_F(SubmittedUnits, ThoseThatAreNotBegunAgainKeepTheirEnd) {
  folder_.write("0.exit", "0\n");
  folder_.write("0.log", "{\"sets\": 7}\n");
  folder_.write("1.exit", "65\n");

  const auto left = run_submitted(order_,
                                  {.files = {},
                                   .command = {"bash", "-c", "echo 0 >'" + (folder_.path() / "2.exit").string() + "'"},
                                   .goes_on = true},
                                  watch_);

  ASSERT_TRUE(left);
  EXPECT_EQ(results_["a"].kind, Kind::Tracked);
  EXPECT_THAT(results_["b"].reason, HasSubstr("did not end"));
}

TEST_F(SubmittedUnits, ARefusalIsToldWithItsReason) {
  const auto refused = run("echo 'invalid partition' >&2; exit 1");

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Io);
  EXPECT_THAT(refused.error().message, HasSubstr("invalid partition"));
  EXPECT_TRUE(results_.empty());
}

TEST_F(SubmittedUnits, AMissingProgramIsToldWithItsPackage) {
  const auto refused =
      run_submitted(order_, {.files = {}, .command = {"mocap-none"}, .package = "some-package"}, watch_);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::NotFound);
  EXPECT_THAT(refused.error().message, HasSubstr("install the Debian package some-package"));
}

TEST_F(SubmittedUnits, AStopEndsTheCommand) {
  on_progress_ = [this] { stops_ = 1; };

  const auto left = run("exec sleep 1000");

  ASSERT_TRUE(left);
  EXPECT_EQ(*left, 3U);
  EXPECT_TRUE(results_.empty());
}

}  // namespace submitted_test
}  // namespace mocap::farm
