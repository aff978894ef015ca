#include "chaos/stage.h"

#include <gtest/gtest.h>

#include "chaos/faulty_cameras.h"
#include "chaos/scripted_actor.h"

namespace mocap::chaos {
namespace stage_test {

// A person of one marker and one bone, at the origin, 1.7 m above the floor.
class Statue final : public scene::Actor {
 public:
  const MarkerSet& marker_set() const override { return set_; }
  void at(double, scene::ActorState& into) const override {
    into = {};
    into.markers.push_back({{{0.0, 0.0, 1.7}}, true});
    into.world_from_bone.push_back({});
  }

 private:
  MarkerSet set_;
};

TEST(ScriptedActor, LeavesLiesDownAndChangesPlaces) {
  const auto actor = make_scripted_actor(std::make_unique<Statue>(), {0, {0.5, 0.0}, {-0.5, 0.0}},
                                         {{FaultKind::SubjectAway, 1.0, 1.0, 0, 0.0},
                                          {FaultKind::SubjectLies, 3.0, 2.0, 0, 0.0},
                                          {FaultKind::SubjectsSwap, 6.0, 1.0, 0, 0.0}});
  scene::ActorState state;

  actor->at(0.5, state);
  EXPECT_TRUE(state.markers[0].there);
  EXPECT_NEAR(state.markers[0].position.v.x(), 0.5, 1e-12);
  actor->at(1.5, state);
  EXPECT_FALSE(state.markers[0].there);
  actor->at(4.0, state);
  EXPECT_NEAR(state.markers[0].position.v.z(), 0.2, 1e-12);
  actor->at(5.5, state);
  EXPECT_NEAR(state.markers[0].position.v.z(), 1.7, 1e-12);
  actor->at(8.0, state);
  EXPECT_NEAR(state.markers[0].position.v.x(), -0.5, 1e-12);
}

// The fastest speed, m/s, of a person with these faults, in steps of 1 ms.
double fastest_m_s(const std::vector<Fault>& faults) {
  const auto actor = make_scripted_actor(std::make_unique<Statue>(), {0, {0.5, 0.0}, {-0.5, 0.0}}, faults);
  scene::ActorState state;
  actor->at(0.0, state);
  double fastest = 0.0;
  for (int ms = 1; ms < 6000; ++ms) {
    const Eigen::Vector3d before = state.markers[0].position.v;
    actor->at(0.001 * ms, state);
    fastest = std::max(fastest, (state.markers[0].position.v - before).norm() / 0.001);
  }
  return fastest;
}

TEST(ScriptedActor, MovesWithoutAJumpWhenFaultsOverlap) {
  const Fault swap{FaultKind::SubjectsSwap, 1.0, 1.5, 0, 0.0};
  const Fault second_swap{FaultKind::SubjectsSwap, 1.2, 1.5, 0, 0.0};
  const Fault third_swap{FaultKind::SubjectsSwap, 3.0, 1.5, 0, 0.0};
  const Fault lies{FaultKind::SubjectLies, 1.0, 2.0, 0, 0.0};
  const Fault second_lies{FaultKind::SubjectLies, 2.0, 2.0, 0, 0.0};

  EXPECT_EQ(fastest_m_s({swap, second_swap, third_swap}), fastest_m_s({swap, third_swap}));
  EXPECT_LT(fastest_m_s({swap, third_swap}), 2.0);
  EXPECT_NEAR(fastest_m_s({lies, second_lies}), fastest_m_s({lies}), 1e-9);
}

struct Images {
  std::size_t count = 0;
  Duration longest_delay{};
  Duration largest_step{};  // of the stamps of successive images, at 50 Hz
};

// The images of camera 1 in 1 s with one fault.
Images images_with(std::vector<Fault> faults) {
  Episode episode;
  episode.rate_hz = 50.0;
  episode.faults = std::move(faults);
  auto stage = Stage::make(episode);
  EXPECT_TRUE(stage.has_value());
  FaultyCameras cameras(episode, stage->rig());
  for (int i = 0; i < 50; ++i) {
    stage->step();
    cameras.expose(stage->frames(), stage->t_s());
  }
  Images images;
  std::optional<Arrival> last;
  while (auto arrival = cameras.next(Timestamp::max())) {
    if (arrival->camera != CameraId{0}) continue;
    ++images.count;
    const Timestamp exposed = from_ns(1'000'000'000) + from_s(0.02 * static_cast<double>(arrival->number));
    images.longest_delay = std::max(images.longest_delay, arrival->received - exposed);
    if (last) images.largest_step = std::max(images.largest_step, arrival->stamp - last->stamp);
    last = std::move(arrival);
  }
  return images;
}

TEST(FaultyCameras, DeliverPerfectImagesWithoutFaults) {
  const Images images = images_with({});

  EXPECT_EQ(images.count, 50u);
  EXPECT_LT(images.longest_delay, std::chrono::milliseconds(4));
  EXPECT_EQ(images.largest_step, std::chrono::milliseconds(20));
}

TEST(FaultyCameras, LoseDelayAndRepeatImagesAndStepTheirClock) {
  EXPECT_LT(images_with({{FaultKind::FramesLost, 0.0, 1.0, 0, 0.5}}).count, 40u);
  EXPECT_EQ(images_with({{FaultKind::Unplugged, 0.5, 1.0, 0, 0.0}}).count, 25u);
  EXPECT_EQ(images_with({{FaultKind::FramesRepeated, 0.0, 2.0, 0, 1.0}}).count, 100u);
  EXPECT_GT(images_with({{FaultKind::FramesLate, 0.0, 2.0, 0, 0.1}}).longest_delay, std::chrono::milliseconds(50));
  EXPECT_GT(images_with({{FaultKind::ClockStep, 0.5, 2.0, 0, 1.0}}).largest_step, std::chrono::seconds(1));
  EXPECT_EQ(images_with({{FaultKind::Bumped, 0.0, 2.0, 1, 1.0}}).count, 50u) << "of another camera";
}

}  // namespace stage_test
}  // namespace mocap::chaos
