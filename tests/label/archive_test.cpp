#include "base/archive.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "label/label_world.h"

namespace mocap::label {
namespace archive_test {

using test::LabelWorld;

std::vector<std::byte> write(Labeller& labeller) {
  static std::vector<std::byte> memory(2'000'000);
  Archive members = Archive::writer(memory);
  labeller.archive(members);
  EXPECT_TRUE(members.ok());
  return {memory.begin(), memory.begin() + static_cast<std::ptrdiff_t>(members.size())};
}

// All numbers of a labelling.
std::vector<std::byte> bytes_of(const Labelling& labelling) {
  static std::vector<std::byte> memory(1'000'000);
  Archive bytes = Archive::writer(memory);
  for (SubjectLabels subject : labelling.labels) {
    bytes(subject.subject, subject.phase, subject.identifications);
    for (LabelledMarker& one : subject.markers) {
      bytes(one.state, one.position.v, one.covariance_m2, one.residual_px, one.cameras, one.seen_by, one.confidence,
            one.track);
    }
  }
  for (AmbiguousObservation one : labelling.ambiguous_observations) bytes(one.label, one.position.v, one.sigma_m);
  std::optional<SubjectFit> fit = labelling.fit;
  bytes(fit);
  if (labelling.search != nullptr) {
    SearchReport report = *labelling.search;
    bytes(report.subject, report.is_fitted, report.at, report.confirmed, report.still);
    for (WorldPoint& point : report.points) bytes(point.v);
  }
  EXPECT_TRUE(bytes.ok());
  return {memory.begin(), memory.begin() + static_cast<std::ptrdiff_t>(bytes.size())};
}

// A second labeller gets the same sets. After each set, it is replaced by a new labeller that reads its belief.
struct ArchivedWorld : LabelWorld {
  void identify_all() {
    second = make_labeller(settings, subjects());
    observer = [this](const TrackedMarkers& tracked, const Predictions& predicted, const Labelling& labelling) {
      ++sets;
      ambiguous += labelling.ambiguous_observations.empty() ? 0 : 1;
      reports += labelling.search == nullptr ? 0 : 1;
      if (bytes_of(labelling) != bytes_of(second->label(tracked, predicted))) ++different_sets;
      replace_second();
    };
    LabelWorld::identify_all();
  }

  void replace_second() {
    const std::vector<std::byte> belief = write(*second);
    std::unique_ptr<Labeller> next = make_labeller(settings, subjects());
    Archive members = Archive::reader(belief);
    next->archive(members);
    ASSERT_TRUE(members.ok()) << sets;
    ASSERT_EQ(members.size(), belief.size()) << sets;
    second = std::move(next);
  }

  void expect_equal() const { EXPECT_EQ(different_sets, 0) << "of " << sets; }

  std::unique_ptr<Labeller> second;
  int sets = 0, different_sets = 0, ambiguous = 0, reports = 0;
};

TEST(Archive, ContinuesTheSearchForLimbsWithTheSameLabels) {
  ArchivedWorld world;
  world.settings.limb_work = 3;
  LabelWorld::Person& one = world.add("baseline41", test::hands_and_feet_together());
  world.identify_all();
  ASSERT_EQ(world.phase(), SubjectPhase::Tracking);
  for (const char* limb :
       {"LeftLowArm LeftHand", "LeftLowLeg RightLowLeg LeftFoot RightFoot", "RightLowArm RightHand"}) {
    const std::vector<std::size_t> markers = test::markers_of(one, limb);
    for (const std::size_t m : markers) one.tracks[m].coasts = true;
    world.step(3);
    for (const std::size_t m : markers) one.tracks[m].hidden = true;
    world.step(67);
    world.reappear(one.tracks[markers[1]]);
    world.step(20);
    for (const std::size_t m : markers) world.reappear(one.tracks[m]);
    world.step(40);
  }

  world.expect_equal();
  EXPECT_GT(world.ambiguous, 0);
}

TEST(Archive, GivesTheSameLabelsWhileTracksJumpEndAndExchangeTheirMarkers) {
  std::mt19937 random(31);
  ArchivedWorld world;
  world.settings.limb_work = 5;
  LabelWorld::Person& one = world.add("baseline41", test::walking(), {0.0, 0.0, 1.0}, 0.0, 1.06);
  world.identify_all();
  ASSERT_EQ(world.phase(), SubjectPhase::Tracking);
  std::uniform_int_distribution<std::size_t> any(0, one.tracks.size() - 1);
  for (int set = 0; set < 300; ++set) {
    LabelWorld::Track& track = one.tracks[any(random)];
    switch (set % 6) {
      case 0: track.hidden = true; break;
      case 1: track.coasts = true; break;
      case 2: track.off.z() = 0.005 * static_cast<double>(any(random) % 10); break;
      case 3: world.exchange(track, one.tracks[any(random)]); break;
      default:
        if (track.hidden) world.reappear(track);
        track.coasts = false;
    }
    world.step();
  }

  world.expect_equal();
}

TEST(Archive, ContinuesTheSearchForALostBodyWithTheSameLabels) {
  ArchivedWorld world;
  world.settings.search_work = 400;
  LabelWorld::Person& one = world.add("baseline41", test::walking());
  world.identify_all();
  ASSERT_EQ(world.phase(), SubjectPhase::Tracking);
  world.step(60);
  for (int round = 0; round < 2; ++round) {
    for (LabelWorld::Track& track : one.tracks) track.hidden = true;
    world.step(130);
    ASSERT_NE(world.phase(), SubjectPhase::Tracking);
    for (LabelWorld::Track& track : one.tracks) world.reappear(track);
    one.tracks[3].hidden = one.tracks[20].hidden = true;
    world.step(200);
    ASSERT_EQ(world.phase(), SubjectPhase::Tracking);
  }

  world.expect_equal();
  EXPECT_GT(world.reports, 0);
}

TEST(Archive, ContinuesTheSearchForAPersonWhoHeldNoTPose) {
  ArchivedWorld world;
  world.settings.still_for = std::chrono::hours(1);
  world.settings.search_uncalibrated = true;
  world.settings.search_work = 400;
  world.add("baseline41", test::walking(), {0.0, 0.0, 1.0}, 0.0, 0.95);
  world.identify_all();
  world.step(300);

  EXPECT_EQ(world.phase(), SubjectPhase::Tracking);
  world.expect_equal();
}

TEST(Archive, ContinuesWithTwoPeopleAndAProp) {
  ArchivedWorld world;
  world.add("baseline41", test::walking(), {0.0, 0.0, 1.0}, 0.0, 1.05);
  world.add("openmocap18", test::hands_and_feet_together(), {1.5, 0.5, 0.9}, 1.0, 0.95);
  world.add("rigid4", test::into_posture({}), {-1.0, 1.0, 1.2});
  world.identify_all();
  world.step(40);
  SubjectFit fit = *world.take_fit();
  for (Eigen::Vector3d& offset_m : fit.marker_offsets_m) offset_m *= 1.001;
  world.labeller().refit(fit);
  world.second->refit(fit);
  world.step(40);
  world.labeller().set_away(SubjectId{2}, true);
  world.second->set_away(SubjectId{2}, true);
  world.step(40);
  world.labeller().reset(SubjectId{0});
  world.second->reset(SubjectId{0});
  world.step(100);

  world.expect_equal();
}

TEST(Archive, RefusesATruncatedBelief) {
  ArchivedWorld world;
  world.add("baseline41", test::walking());
  world.identify_all();
  const std::vector<std::byte> belief = write(*world.second);
  for (std::size_t size = 0; size < belief.size(); size += belief.size() / 20) {
    const std::unique_ptr<Labeller> labeller = make_labeller(world.settings, world.subjects());
    Archive members = Archive::reader(std::span(belief).first(size));
    labeller->archive(members);

    EXPECT_FALSE(members.ok()) << size;
  }
}

}  // namespace archive_test
}  // namespace mocap::label
