#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "base/log.h"
#include "chaos/run_episode.h"
#include "chaos/seed_batch.h"
#include "chaos/shrink.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

// Four defects behind the steps, each of which shows only after a certain fault: the simulation finds each of them,
// and names the fault.

namespace mocap::chaos {
namespace planted_defects_test {

constexpr std::uint64_t kSeeds = 200;

class PlantedDefect : public testing::Test {
 protected:
  void SetUp() override {
    if (support::kSanitized)
      GTEST_SKIP() << "many seeds take minutes under a sanitizer, which watches chaos.seeds instead";
  }
};

struct Found {
  Episode episode;
  Failure failure;
};

// The first failure of the seeds up to kSeeds.
std::optional<Found> find(const Sabotage& sabotage, const std::filesystem::path& folder) {
  set_log_level(LogLevel::Error);
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Episode episode = draw_episode(seed);
    const auto verdict = run_episode(episode, folder, sabotage);
    if (!verdict) ADD_FAILURE() << verdict.error().message;
    if (!verdict) return std::nullopt;
    if (verdict->failure) return Found{episode, *verdict->failure};
  }
  return std::nullopt;
}

TEST_F(PlantedDefect, ALabelThatOccursTwiceIsFoundAndReducedToItsFault) {
  const support::TemporaryFolder folder;
  // The labels of a set with few views have one track twice.
  const Sabotage sabotage{.snapshot =
                              [](Snapshot& snapshot) {
                                if (snapshot.views.size() > 2 || snapshot.labels.empty()) return;
                                auto& markers = snapshot.labels[0].markers;
                                if (markers.size() < 2 || !markers[0].track.names_something()) return;
                                markers[1] = markers[0];
                              },
                          .take = {}};

  const auto found = find(sabotage, folder.path());

  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->failure.invariant, "labels are unique");
  const auto fails = [&](const std::vector<Fault>& faults) {
    Episode episode = found->episode;
    episode.faults = faults;
    const auto verdict = run_episode(episode, folder.path(), sabotage);
    return verdict && verdict->failure && verdict->failure->invariant == found->failure.invariant;
  };
  const std::vector<Fault> fewest = shrink(found->episode.faults, fails);
  EXPECT_LE(fewest.size(), found->episode.faults.size());
  EXPECT_TRUE(fails(fewest));
}

TEST_F(PlantedDefect, ATimeThatGoesBackIsFound) {
  const support::TemporaryFolder folder;
  // After a gap, one snapshot has the time of the one before the gap.
  std::optional<Snapshot> last;
  const Sabotage sabotage{.snapshot =
                              [&last](Snapshot& snapshot) {
                                if (last && snapshot.number < last->number) last.reset();  // another episode
                                const Timestamp at = snapshot.instants.exposed_at;
                                if (last && at - last->instants.exposed_at > std::chrono::milliseconds(100)) {
                                  snapshot.instants.exposed_at = last->instants.exposed_at - Duration{1};
                                }
                                last = snapshot;
                                last->instants.exposed_at = at;
                              },
                          .take = {}};

  const auto found = find(sabotage, folder.path());

  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->failure.invariant, "time goes on");
}

TEST_F(PlantedDefect, ATakeWithoutItsIndexIsFound) {
  const support::TemporaryFolder folder;
  const Sabotage sabotage{.snapshot = {}, .take = [](const std::filesystem::path& take) {
                            std::error_code gone;
                            const auto size = std::filesystem::file_size(take, gone);
                            if (!gone && size > 100) std::filesystem::resize_file(take, size - 100);
                          }};

  const auto found = find(sabotage, folder.path());

  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->failure.invariant, "a take is open or whole");
}

TEST_F(PlantedDefect, ASkeletonThatIsNotFoundAgainIsFound) {
  const support::TemporaryFolder folder;
  bool lost = false;
  const Sabotage sabotage{.snapshot =
                              [&lost](Snapshot& snapshot) {
                                if (snapshot.number < 10) lost = false;
                                lost = lost || (snapshot.number > 90 && snapshot.views.size() < 4);
                                if (lost) snapshot.poses.clear();
                              },
                          .take = {}};

  const auto found = find(sabotage, folder.path());

  ASSERT_TRUE(found.has_value());
  EXPECT_EQ(found->failure.invariant, "skeletons are right again");
}

TEST(RunTwice, FindsARunThatDependsOnMoreThanTheSeed) {
  const support::TemporaryFolder folder;
  set_log_level(LogLevel::Error);
  Episode episode = draw_episode(1);
  episode.faults.clear();
  std::uint64_t calls = 0;
  const Sabotage sabotage{.snapshot =
                              [&calls](Snapshot& snapshot) {
                                if (++calls == 1) snapshot.expected_views = 9;
                              },
                          .take = {}};

  const auto verdict = run_twice(episode, folder.path(), sabotage);

  ASSERT_TRUE(verdict.has_value() && verdict->failure.has_value());
  EXPECT_EQ(verdict->failure->invariant, "the same seed gives the same hash");
}

}  // namespace planted_defects_test
}  // namespace mocap::chaos
