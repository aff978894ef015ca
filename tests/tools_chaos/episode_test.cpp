#include "chaos/episode.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

namespace mocap::chaos {
namespace episode_test {

TEST(DrawEpisode, GivesTheSameEpisodeForTheSameSeed) {
  const Episode one = draw_episode(17), same = draw_episode(17), other = draw_episode(18);

  EXPECT_EQ(one.faults, same.faults);
  EXPECT_EQ(one.cameras, same.cameras);
  EXPECT_NE(one.faults, other.faults);
}

TEST(DrawEpisode, KeepsFaultsWithinTheirTimeAndLeavesTimeForTheRecovery) {
  std::set<FaultKind> kinds;
  for (std::uint64_t seed = 1; seed <= 500; ++seed) {
    const Episode episode = draw_episode(seed);
    for (const Fault& fault : episode.faults) {
      kinds.insert(fault.kind);
      EXPECT_GE(fault.from_s, 1.0);
      EXPECT_LT(fault.to_s() + kRecovery_s, episode.seconds);
      EXPECT_LT(fault.target, std::max(episode.cameras, episode.subjects));
    }
  }
  EXPECT_EQ(kinds.size(), static_cast<std::size_t>(FaultKind::Reload) + 1) << "each kind is drawn";
}

TEST(Fault, IsNamedWithItsTimeTargetAndAmount) {
  EXPECT_EQ(to_text({FaultKind::FramesLost, 2.0, 0.5, 2, 0.25}),
            "2.000 s for 0.500 s: frames-lost camera 3, 0.25 of the frames");
  EXPECT_EQ(to_text({FaultKind::SubjectAway, 2.0, 0.5, 0, 0.0}), "2.000 s for 0.500 s: subject-away subject 1");
}

TEST(Fault, IsActiveFromItsBeginToItsEndForItsTarget) {
  const std::vector<Fault> faults{{FaultKind::Bumped, 2.0, 0.5, 1, 1.0}};

  EXPECT_EQ(active_fault(faults, FaultKind::Bumped, 1, 1.99), nullptr);
  EXPECT_EQ(active_fault(faults, FaultKind::Bumped, 1, 2.0), &faults[0]);
  EXPECT_EQ(active_fault(faults, FaultKind::Bumped, 1, 2.5), nullptr);
  EXPECT_EQ(active_fault(faults, FaultKind::Bumped, 0, 2.2), nullptr);
}

}  // namespace episode_test
}  // namespace mocap::chaos
