#include "chaos/seed_batch.h"

#include <gmock/gmock.h>

#include <set>

#include "base/log.h"
#include "chaos/hash.h"
#include "chaos/isolated_run.h"
#include "chaos/report.h"
#include "support/temporary_folder.h"

namespace mocap::chaos {
namespace seed_batch_test {

using ::testing::HasSubstr;

TEST(RunSeeds, RunsEachSeedInAProcessOfItsOwn) {
  const support::TemporaryFolder folder;
  set_log_level(LogLevel::Error);
  std::set<std::uint64_t> seeds;

  const auto ran = run_seeds({.first = 3, .last = 5, .jobs = 2, .folder = folder.path(), .no_start_after = {}},
                             [&](const SeedResult& result) {
                               seeds.insert(result.episode.seed);
                               EXPECT_GT(result.verdict.sets, 0u);
                             });

  ASSERT_TRUE(ran.has_value());
  EXPECT_EQ(*ran, 3u);
  EXPECT_EQ(seeds, (std::set<std::uint64_t>{3, 4, 5}));
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "the takes are removed";
}

TEST(RunSeeds, FailsIfTheFolderDoesNotExist) {
  const auto ran = run_seeds({.first = 1, .last = 2, .jobs = 1, .folder = "/nowhere", .no_start_after = {}},
                             [](const SeedResult&) { ADD_FAILURE(); });

  ASSERT_FALSE(ran.has_value());
  EXPECT_THAT(ran.error().message, HasSubstr("/nowhere"));
}

TEST(IsolatedRun, GivesTheHashOfARunInThisProcess) {
  const support::TemporaryFolder folder;
  set_log_level(LogLevel::Error);
  const Episode episode = draw_episode(4);

  auto isolated = IsolatedRun::start(episode, folder.path());
  ASSERT_TRUE(isolated.has_value());
  const auto apart = isolated->finish();
  const auto here = run_episode(episode, folder.path());

  ASSERT_TRUE(apart.has_value() && here.has_value());
  EXPECT_EQ(apart->hash, here->hash);
}

// A stage without cameras stops the process (MOCAP_EXPECTS).
TEST(IsolatedRun, ReportsACrashAsAFinding) {
  const support::TemporaryFolder folder;
  Episode episode = draw_episode(4);
  episode.cameras = 0;

  auto isolated = IsolatedRun::start(episode, folder.path());
  ASSERT_TRUE(isolated.has_value());
  const auto verdict = isolated->finish();

  ASSERT_TRUE(verdict.has_value() && verdict->failure.has_value());
  EXPECT_EQ(verdict->failure->invariant, "the daemon does not crash");
  EXPECT_THAT(verdict->failure->words, HasSubstr("signal"));
}

TEST(Report, NamesSeedCommitInvariantAndFaults) {
  SeedResult failing;
  failing.episode.seed = 42;
  failing.episode.faults = {{FaultKind::DiskFull, 2.0, 0.5, 0, 100.0}};
  failing.verdict.failure = Failure{"time goes on", "set 3 follows set 3", 2.5, 120};

  const std::string text = failure_text(failing, "abc123"), json = failure_json(failing, "abc123");

  for (const char* part : {"seed 42", "abc123", "time goes on", "set 3 follows set 3", "step 120", "disk-full"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(json, HasSubstr(R"("seed":42)"));
  EXPECT_FALSE(commit_of_tree().empty());
}

TEST(Hash, DependsOnTheOrderOfTheBytes) {
  Hash one, other;
  one.add("ab");
  other.add("ba");

  EXPECT_NE(one.value(), other.value());
}

}  // namespace seed_batch_test
}  // namespace mocap::chaos
