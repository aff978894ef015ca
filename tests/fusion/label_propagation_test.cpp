#include <gtest/gtest.h>

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "fusion/fusion.h"
#include "support/empty_row.h"

namespace mocap::fusion {
namespace {

constexpr TrackId kTrack{7};
constexpr Label kName{SubjectId{0}, 2};
const Eigen::Vector3d kTracked(0.0, 0.0, 1.0);  // where its track leads to, not surely
const Eigen::Vector3d kTold(0.1, 0.0, 1.0);     // where the body says that it is, more surely

/// What a test says of the one marker, and what the row made of it.
struct Script {
  int cameras = 0;                      // see it
  TrackId bearer;                       // the track that bears the name
  bool called = false;                  // the matcher was told the name
  Eigen::Vector3d place;                // and where to look for the track
  bool ray = false;                     // the solver was told a ray of that name
  bool ambiguous_observations = false;  // and what the labeller surmised
};

class ScriptedMatcher : public Matcher {
 public:
  explicit ScriptedMatcher(Script& script) : script_(script) {}
  const Matches& match(const FrameSet&, const Expected& expected) override {
    script_.called = expected.markers[0].label == kName;
    script_.place = expected.markers[0].position.v;
    matches_.bearing_only.clear();
    matches_.matches.clear();
    if (script_.cameras == 1) matches_.bearing_only.push_back({});
    if (script_.cameras > 1) matches_.matches.push_back({}).expected = 0;
    return matches_;
  }

 private:
  Script& script_;
  Matches matches_;
};

class OneTrack : public support::EmptyTracker {
 public:
  void predict(Timestamp, Expected& into) const override {
    ExpectedMarker& one = into.markers.push_back({});
    one.track = kTrack;
    one.position.v = kTracked;
  }
};

class ScriptedLabeller : public support::EmptyLabeller {
 public:
  explicit ScriptedLabeller(Script& script) : script_(script) {
    labels_.resize(1);
    labels_[0].subject = kName.subject;
    labels_[0].markers.resize(3);
  }
  const Labels& label(const TrackedMarkers&, const Expected&) override {
    labels_[0].markers[kName.marker].track = script_.bearer;
    return labels_;
  }
  std::span<const AmbiguousObservation> ambiguous_observations() const override {
    return {&ambiguous_observations_, 1};
  }

 private:
  Script& script_;
  Labels labels_;
  AmbiguousObservation ambiguous_observations_{kName, {kTold}};
};

class ScriptedSolver : public support::EmptySolver {
 public:
  explicit ScriptedSolver(Script& script) : script_(script) {}
  const Poses& solve(Labels& labels, Timestamp at, std::span<const LabelledBearing> rays,
                     std::span<const AmbiguousObservation> ambiguous_observations) override {
    script_.ray = rays.size() == 1 && rays[0].label == kName;
    script_.ambiguous_observations = ambiguous_observations.size() == 1 && ambiguous_observations[0].label == kName;
    return EmptySolver::solve(labels, at, rays, ambiguous_observations);
  }
  void predict(Timestamp, Expected& into) const override {
    ExpectedMarker& one = into.markers.push_back({});
    one.label = kName;
    one.position.v = kTold;
    one.covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
  }

 private:
  Script& script_;
};

class FuseNames : public testing::Test {
 protected:
  FuseNames() {
    FusionParts parts = support::empty_row();
    parts.matcher = std::make_unique<ScriptedMatcher>(script);
    parts.tracker = std::make_unique<OneTrack>();
    parts.labeller = std::make_unique<ScriptedLabeller>(script);
    parts.solver = std::make_unique<ScriptedSolver>(script);
    fusion.emplace(std::move(parts), 1U);
    view_.camera = CameraId{0};
    script.bearer = kTrack;
    step(2);
    script.bearer = {};
  }
  void step(int sets = 1) {
    for (int i = 0; i < sets; ++i) {
      FrameSet frames;
      frames.number = number_++;
      frames.exposed_at = from_ns(1'000'000'000) + from_s(static_cast<double>(frames.number) / 120.0);
      frames.views.push_back(&view_);
      (void)fusion->step(frames);
    }
  }

  Script script;
  std::optional<Fusion> fusion;

 private:
  BlobFrame view_;
  std::uint64_t number_ = 0;
};

TEST_F(FuseNames, ARayOfAHiddenMarkerKeepsItsNameAsLongAsOneCameraSeesIt) {
  script.cameras = 1;

  step(200);

  EXPECT_TRUE(script.called);
  EXPECT_TRUE(script.ray);
}

TEST_F(FuseNames, WhatTheLabellerSurmisesReachesTheSolver) { EXPECT_TRUE(script.ambiguous_observations); }

TEST_F(FuseNames, ANameOutlivesAMomentInWhichNoCameraSeesTheMarker) {
  step(10);
  EXPECT_TRUE(script.called);
  script.cameras = 1;
  step();

  EXPECT_TRUE(script.ray);
}

TEST_F(FuseNames, ATrackThatNobodySawForLongHasNoNameAnyMore) {
  step(30);
  EXPECT_FALSE(script.called);
  script.cameras = 1;
  step();

  EXPECT_FALSE(script.ray);
}

TEST_F(FuseNames, ANameOutlivesItsLastRayBy150Ms) {
  script.cameras = 1;
  step();
  script.cameras = 0;

  step(18);  // the last of them 150 ms after the ray
  EXPECT_TRUE(script.called);

  step(2);
  EXPECT_FALSE(script.called);
}

TEST_F(FuseNames, ANameThatLeftATrackThatTwoCamerasSeeIsNotKept) {
  script.cameras = 2;

  step(2);

  EXPECT_FALSE(script.called);
}

TEST_F(FuseNames, ANameThatAnotherTrackBearsIsNotKept) {
  script.cameras = 1;
  script.bearer = TrackId{8};

  step(2);

  EXPECT_FALSE(script.called);
  EXPECT_FALSE(script.ray);
}

TEST_F(FuseNames, AMarkerThatOneCameraSeesIsSoughtWhereTheBodySaysIfThatIsSurer) {
  script.bearer = kTrack;
  step();
  EXPECT_EQ(script.place, kTracked);
  script.bearer = {};
  script.cameras = 1;

  step(2);

  EXPECT_EQ(script.place, kTold);
}

}  // namespace
}  // namespace mocap::fusion
