#include "lib/farm/local_farm.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <map>

#include "support/temporary_folder.h"

namespace mocap::farm {
namespace local_farm_test {

using ::testing::HasSubstr;
using Kind = UnitResult::Kind;

// Stands for mocapctl: the name of the take says what happens. $3 is the take, $5 the new one.
constexpr const char* kProgram = R"(#!/bin/sh
echo "progress 0.5" >&2
touch "$5.begun"
case "$3" in
  *bad*) echo "mocapctl: is bad" >&2; exit 65 ;;
  *once*) if mkdir "$5.killed" 2>/dev/null; then touch "$(dirname "$5")/.once.part.mcap"; kill -9 $$; fi ;;
  *always*) kill -9 $$ ;;
  *endless*) exec sleep 1000 ;;
esac
echo '{"sets": 7, "kept": false}'
)";

class LocalFarm : public testing::Test {
 protected:
  LocalFarm() {
    program_ = folder_.write("mocapctl", kProgram);
    std::filesystem::permissions(program_, std::filesystem::perms::owner_all);
    watch_.progress = [this](const FarmProgress& now) {
      progress_ = now;
      if (now.share < shares_) shares_ = 2.0;  // went back
      shares_ = now.share;
      if (on_progress_) on_progress_();
    };
    watch_.ended = [this](const Unit& unit, const UnitResult& result) { results_[unit.take.stem().string()] = result; };
    watch_.stops = [this] { return stops_; };
  }

  std::size_t run(const std::vector<std::string>& names, int jobs) {
    std::vector<Unit> units;
    for (const std::string& name : names) units.push_back({name + ".mcap", folder_.path() / (name + ".mcap"), 100});
    return run_here(units, {program_, {}}, jobs, watch_);
  }

  bool exists(const std::string& name) const { return std::filesystem::exists(folder_.path() / name); }

  support::TemporaryFolder folder_;
  std::filesystem::path program_;
  FarmWatch watch_;
  FarmProgress progress_;
  double shares_ = 0.0;
  std::function<void()> on_progress_;
  int stops_ = 0;
  std::map<std::string, UnitResult> results_;
};

TEST_F(LocalFarm, AUnitThatFailsDoesNotStopTheOthers) {
  const std::size_t not_begun = run({"a", "bad", "b", "c"}, 2);

  EXPECT_EQ(not_begun, 0U);
  ASSERT_EQ(results_.size(), 4U);
  for (const char* name : {"a", "b", "c"}) EXPECT_EQ(results_[name].kind, Kind::Tracked);
  EXPECT_EQ(results_["a"].report.at("sets"), 7);
  EXPECT_EQ(results_["bad"].kind, Kind::Failed);
  EXPECT_EQ(results_["bad"].exit_code, 65);
  EXPECT_EQ(results_["bad"].reason, "is bad");
  EXPECT_EQ(progress_.ended, 4U);
  EXPECT_EQ(progress_.failed, 1U);
  EXPECT_EQ(progress_.share, 1.0);
}

TEST_F(LocalFarm, AUnitThatWasKilledIsBegunOnceMore) {
  run({"once", "always"}, 2);

  EXPECT_EQ(results_["once"].kind, Kind::Tracked);
  EXPECT_FALSE(exists(".once.part.mcap")) << "what the killed process left";
  EXPECT_EQ(results_["always"].kind, Kind::Failed);
  EXPECT_THAT(results_["always"].reason, HasSubstr("signal 9, 2 times"));
}

TEST_F(LocalFarm, AStopEndsTheUnitsThatRunAndBeginsNoMore) {
  on_progress_ = [this] {
    if (exists("endless1.mcap.begun") && exists("endless2.mcap.begun")) stops_ = 1;
  };

  const std::size_t not_begun = run({"endless1", "endless2", "a", "b"}, 2);

  EXPECT_EQ(not_begun, 2U);
  EXPECT_EQ(results_["endless1"].kind, Kind::Stopped);
  EXPECT_EQ(results_["endless2"].kind, Kind::Stopped);
  EXPECT_FALSE(exists("a.mcap.begun"));
}

TEST_F(LocalFarm, AProgramThatDoesNotExistFailsEachUnit) {
  program_ = "/nowhere/mocapctl";

  run({"a", "b"}, 1);

  EXPECT_EQ(results_["a"].kind, Kind::Failed);
  EXPECT_THAT(results_["b"].reason, HasSubstr("/nowhere/mocapctl"));
}

TEST(UsableProcessors, AreAtLeastOne) { EXPECT_GE(usable_processors(), 1); }

}  // namespace local_farm_test
}  // namespace mocap::farm
