#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "assemble.h"
#include "assemble_camera.h"
#include "base/wake_signal.h"
#include "cameras/node/node_settings.h"
#include "cameras/synthetic/synthetic_settings.h"
#include "scene/ring_rig.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"

namespace mocap {
namespace handover_test {

constexpr std::uint64_t kChangedAfterSets = 250;  // the subject walks; it was identified in its T-pose
constexpr std::uint64_t kSetsAfterChange = 20;
constexpr std::uint64_t kSets = 400;

// Result for the first subject in one set: phase, then state and position of each marker, then position of each bone.
struct Line {
  std::uint64_t number = 0;
  std::uint32_t version = 0;
  SubjectPhase phase = SubjectPhase::Searching;
  std::vector<double> values;
};

// What subscribers receive. The lines belong to the publish thread until `through`.
struct Received {
  std::vector<Line> lines;
  std::vector<std::uint32_t> described;
  std::atomic<std::uint64_t> sets{0};
  std::uint64_t while_running = 0;  // sets before the stop, from which on cameras may be missing
  WakeSignal changed;

  bool wait_for(std::uint64_t count) {
    const Timestamp limit = host_now() + std::chrono::seconds(200);
    while (sets < count && host_now() < limit) {
      const WakeSignal::Ticket ticket = changed.ticket();
      if (sets < count) changed.wait(ticket, std::chrono::seconds(1));
    }
    return sets >= count;
  }
};

class RecordingPublisher : public Publisher {
 public:
  explicit RecordingPublisher(Received& received) : received_(received) {}

  Status describe(const Description& description) override {
    received_.described.push_back(description.version);
    return {};
  }
  Status report(const Health& /*health*/) override { return {}; }
  Status publish(Snapshot& snapshot) override {
    EXPECT_EQ(received_.described.back(), snapshot.description_version);
    const SubjectLabels& labels = snapshot.labels.front();
    Line line{snapshot.number, snapshot.description_version, labels.phase, {}};
    for (const LabelledMarker& marker : labels.markers) {
      line.values.push_back(static_cast<double>(marker.state));
      if (marker.state == LabelState::Lost) continue;
      line.values.insert(line.values.end(), marker.position.v.begin(), marker.position.v.end());
    }
    for (const BonePose& bone : snapshot.poses.front().bones) {
      line.values.insert(line.values.end(), bone.world_from_bone.position.begin(), bone.world_from_bone.position.end());
    }
    received_.lines.push_back(std::move(line));
    ++received_.sets;
    received_.changed.signal();
    return {};
  }

 private:
  Received& received_;
};

settings::DaemonSettings replay_of_an_actor(const MarkerSet& worn) {
  settings::DaemonSettings settings;
  settings.rig = scene::ring_rig({.cameras = 4});
  for (const CameraModel& camera : settings.rig) {
    cameras::SyntheticSettings synthetic;
    synthetic.speed = 0.0;
    settings.cameras.push_back({camera.name, synthetic});
    settings.simulated.push_back(worn);
  }
  settings.subjects.push_back({"actor", {}, {}, {}});
  settings.subject_models.push_back({"actor", worn});
  settings.definitions.push_back(worn);
  settings.control.endpoint = "none";
  return settings;
}

// Runs at least `sets` sets; with a change to `next` in between, if there is one, and kSetsAfterChange sets after it.
void run(const settings::DaemonSettings& settings, const settings::DaemonSettings* next, std::uint64_t sets,
         Received& received) {
  Result<Assembly> assembly = assemble(settings);
  ASSERT_TRUE(assembly) << assembly.error().message;
  assembly->parts.publisher = std::make_unique<RecordingPublisher>(received);
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  ASSERT_TRUE(received.wait_for(kChangedAfterSets));
  if (next != nullptr) {
    Result<runtime::PipelineChange> change = assemble_change(settings, *next, pipeline, *assembly->shared);
    ASSERT_TRUE(change) << change.error().message;
    ASSERT_TRUE(pipeline.change(*std::move(change)));
    sets = std::max(sets, received.sets + kSetsAfterChange);
  }
  ASSERT_TRUE(received.wait_for(sets));
  received.while_running = sets;
  pipeline.stop();
}

class HandoverTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto loaded = settings::load_marker_set(support::source_folder() + "/config/markersets/openmocap18.toml");
    ASSERT_TRUE(loaded) << loaded.error().message;
    worn = *loaded;
    before = replay_of_an_actor(worn);
    before.publish.endpoint = "tcp://127.0.0.1:*";
  }

  // The results for the actor with the change equal those without it, and no set is missing.
  void expect_same_as_unchanged(const settings::DaemonSettings& next) {
    Received unchanged, changed;
    run(before, &next, kSets, changed);
    const std::uint64_t sets = changed.while_running;
    run(before, nullptr, sets, unchanged);
    std::size_t tracking = 0;
    for (std::size_t i = 0; i < sets; ++i) {
      ASSERT_EQ(changed.lines[i].number, i);
      ASSERT_EQ(changed.lines[i].phase, unchanged.lines[i].phase) << i;
      ASSERT_EQ(changed.lines[i].values, unchanged.lines[i].values) << i;
      tracking += changed.lines[i].phase == SubjectPhase::Tracking ? 1 : 0;
    }
    EXPECT_GT(tracking, sets / 2);
    EXPECT_GT(changed.lines[sets - 1].version, unchanged.lines[sets - 1].version);
  }

  MarkerSet worn;
  settings::DaemonSettings before;
};

TEST_F(HandoverTest, AReloadWithEqualSettingsGivesTheSameResults) { expect_same_as_unchanged(before); }

TEST_F(HandoverTest, AnotherSubjectDoesNotChangeTheResultsForTheActor) {
  const auto prop = settings::load_marker_set(support::source_folder() + "/config/markersets/rigid4.toml");
  ASSERT_TRUE(prop) << prop.error().message;
  settings::DaemonSettings next = before;
  next.subjects.push_back({"prop", {}, {}, {}});
  next.subject_models.push_back({"prop", *prop});
  next.definitions.push_back(*prop);

  expect_same_as_unchanged(next);
}

// An operator who orders something while the configuration is loaded anew.
class OneRequest : public ControlServer {
 public:
  OneRequest(Received& asked, std::atomic<bool>& done) : asked_(asked), done_(done) {}

  std::optional<ControlRequest> next(Duration patience) override {
    if (asked_.sets > 0) {
      request_.wait(request_.ticket(), patience);
      return std::nullopt;
    }
    asked_.sets = 1;
    asked_.changed.signal();
    ControlRequest request;
    request.action = ControlAction::Reload;
    return request;
  }
  void answer(std::uint64_t, const ControlAnswer& answer) override { done_ = answer.code == ControlCode::Done; }

 private:
  Received& asked_;
  std::atomic<bool>& done_;
  WakeSignal request_;  // another one, which never comes
};

// It names cameras by their numbers before the change.
TEST_F(HandoverTest, AnOrderForTheCamerasBeforeEnds) {
  Received asked, received;
  std::atomic<bool> done{true};
  Result<Assembly> assembly = assemble(before);
  ASSERT_TRUE(assembly) << assembly.error().message;
  assembly->parts.publisher = std::make_unique<RecordingPublisher>(received);
  assembly->parts.control = std::make_unique<OneRequest>(asked, done);
  runtime::Pipeline pipeline(std::move(assembly->settings), std::move(assembly->parts));
  ASSERT_TRUE(asked.wait_for(1));

  Result<runtime::PipelineChange> change = assemble_change(before, before, pipeline, *assembly->shared);
  ASSERT_TRUE(change) << change.error().message;
  ASSERT_TRUE(pipeline.change(*std::move(change)));

  EXPECT_FALSE(pipeline.take_order());
  EXPECT_FALSE(done);
  pipeline.stop();
}

TEST_F(HandoverTest, ASubjectWithAnotherDefinitionDoesNotContinue) {
  settings::DaemonSettings next = before;
  EXPECT_EQ(handover_between(before, next).subjects.front(), SubjectId{0});

  next.definitions.front().markers.front().offset_m.x() += 0.01;

  EXPECT_FALSE(handover_between(before, next).subjects.front().names_something());
}

TEST_F(HandoverTest, PosesContinueWhileMostCamerasStandStill) {
  settings::DaemonSettings next = before;
  const auto move = [&](std::size_t camera, double m) { next.rig[camera].camera_from_world.translation.x() += m; };
  move(0, 0.5);
  EXPECT_TRUE(handover_between(before, next).poses);
  EXPECT_FALSE(handover_between(before, next).matching);
  for (const std::size_t camera : {1, 2, 3}) move(camera, 0.01);
  EXPECT_TRUE(handover_between(before, next).poses);

  for (const std::size_t camera : {1, 2, 3}) move(camera, 0.05);

  EXPECT_FALSE(handover_between(before, next).poses);
}

TEST_F(HandoverTest, OnlyACameraWithAnotherDeviceIsOpenedAnew) {
  settings::DaemonSettings next = before;
  next.cameras[1].driver.as<cameras::SyntheticSettings>()->exposure_us += 100.0;
  next.cameras[2].threshold = 90.0;
  next.rig[3].learnt_masks.push_back({{{0.0, 0.0}}, {{9.0, 0.0}}, {{0.0, 9.0}}});

  EXPECT_EQ(step_of(before, next, CameraId{0}), runtime::CameraStep::Continue);
  EXPECT_EQ(step_of(before, next, CameraId{1}), runtime::CameraStep::Replace);
  EXPECT_EQ(step_of(before, next, CameraId{2}), runtime::CameraStep::Refresh);
  EXPECT_EQ(step_of(before, next, CameraId{3}), runtime::CameraStep::Refresh);
}

TEST_F(HandoverTest, OnlyACameraOfANodeIsOpenedAnewForAnotherWindow) {
  settings::DaemonSettings with_node = before;
  cameras::NodeCameraSettings node;
  node.endpoint = "tcp://10.0.0.2:5580";
  with_node.cameras[1].driver = node;
  settings::DaemonSettings next = with_node;
  ASSERT_EQ(step_of(with_node, next, CameraId{1}), runtime::CameraStep::Continue);

  next.pipeline.align.window *= 2;

  EXPECT_EQ(step_of(with_node, next, CameraId{0}), runtime::CameraStep::Continue);
  EXPECT_EQ(step_of(with_node, next, CameraId{1}), runtime::CameraStep::Replace);
}

}  // namespace handover_test
}  // namespace mocap
