#include <gtest/gtest.h>

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "fusion/fusion.h"
#include "fusion/idle_parts.h"

namespace mocap::fusion {
namespace label_propagation_test {

constexpr TrackId kTrack{7};
constexpr Label kLabel{SubjectId{0}, 2};
const Eigen::Vector3d kPredictedByTrack(0.0, 0.0, 1.0);  // by its 3D track, less certain
const Eigen::Vector3d kPredictedByBody(0.1, 0.0, 1.0);   // by the skeleton, more certain

/// The input of a test about its one marker, and what the parts received.
struct Script {
  int cameras = 0;                      // number of cameras that see the marker
  TrackId labelled_track;               // the track that the labeller gives the label
  bool has_label = false;               // the matcher received the label
  Eigen::Vector3d position;             // the matcher received this prediction
  bool has_bearing = false;             // the solver received a bearing with the label
  bool ambiguous_observations = false;  // the solver received the ambiguous observation
};

class ScriptedMatcher : public Matcher {
 public:
  explicit ScriptedMatcher(Script& script) : script_(script) {}
  const Matches& match(const FrameSet&, const Predictions& predicted) override {
    script_.has_label = predicted.markers[0].label == kLabel;
    script_.position = predicted.markers[0].position.v;
    matches_.bearing_only.clear();
    matches_.matches.clear();
    if (script_.cameras == 1) matches_.bearing_only.push_back({});
    if (script_.cameras > 1) matches_.matches.push_back({}).prediction = 0;
    return matches_;
  }

 private:
  Script& script_;
  Matches matches_;
};

class OneTrack : public fusion::IdleTracker {
 public:
  OneTrack() {
    PredictedMarker& one = predictions_.push_back({});
    one.track = kTrack;
    one.position.v = kPredictedByTrack;
  }
  const PredictedMarkers& predict(Timestamp) override { return predictions_; }

 private:
  PredictedMarkers predictions_;
};

class ScriptedLabeller : public fusion::IdleLabeller {
 public:
  explicit ScriptedLabeller(Script& script) : script_(script) {
    labelling_.labels.resize(1);
    labelling_.labels[0].subject = kLabel.subject;
    labelling_.labels[0].markers.resize(3);
    labelling_.ambiguous_observations.push_back({kLabel, {kPredictedByBody}});
  }
  const Labelling& label(const TrackedMarkers&, const Predictions&) override {
    labelling_.labels[0].markers[kLabel.marker].track = script_.labelled_track;
    return labelling_;
  }

 private:
  Script& script_;
  Labelling labelling_;
};

class ScriptedSolver : public fusion::IdleSolver {
 public:
  explicit ScriptedSolver(Script& script) : script_(script) {
    PredictedMarker& one = predictions_.push_back({});
    one.label = kLabel;
    one.position.v = kPredictedByBody;
    one.covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
  }
  const SolvedSubjects& solve(const Labels& labels, Timestamp at, std::span<const LabelledBearing> rays,
                              std::span<const AmbiguousObservation> ambiguous_observations) override {
    script_.has_bearing = rays.size() == 1 && rays[0].label == kLabel;
    script_.ambiguous_observations = ambiguous_observations.size() == 1 && ambiguous_observations[0].label == kLabel;
    return IdleSolver::solve(labels, at, rays, ambiguous_observations);
  }
  const PredictedMarkers& predict(Timestamp) override { return predictions_; }

 private:
  Script& script_;
  PredictedMarkers predictions_;
};

class LabelPropagation : public testing::Test {
 protected:
  LabelPropagation() {
    FusionParts parts = fusion::make_idle_parts();
    parts.matcher = std::make_unique<ScriptedMatcher>(script);
    parts.tracker = std::make_unique<OneTrack>();
    parts.labeller = std::make_unique<ScriptedLabeller>(script);
    parts.solver = std::make_unique<ScriptedSolver>(script);
    fusion.emplace(std::move(parts), 1U);
    view_.camera = CameraId{0};
    view_.blobs.push_back({});
    script.labelled_track = kTrack;
    step(2);
    script.labelled_track = {};
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

TEST_F(LabelPropagation, KeepsTheLabelOfAHiddenMarkerWhileOneCameraSeesIt) {
  script.cameras = 1;

  step(200);

  EXPECT_TRUE(script.has_label);
  EXPECT_TRUE(script.has_bearing);
}

TEST_F(LabelPropagation, PassesAmbiguousObservationsToTheSolver) { EXPECT_TRUE(script.ambiguous_observations); }

TEST_F(LabelPropagation, KeepsTheLabelWhileNoCameraSeesTheMarkerForAMoment) {
  step(10);
  EXPECT_TRUE(script.has_label);
  script.cameras = 1;
  step();

  EXPECT_TRUE(script.has_bearing);
}

TEST_F(LabelPropagation, DropsTheLabelOfATrackThatNoCameraSawForLong) {
  step(30);
  EXPECT_FALSE(script.has_label);
  script.cameras = 1;
  step();

  EXPECT_FALSE(script.has_bearing);
}

TEST_F(LabelPropagation, RetainsTheLabelFor150MsAfterTheLastBearing) {
  script.cameras = 1;
  step();
  script.cameras = 0;

  step(18);  // the last of them 150 ms after the bearing
  EXPECT_TRUE(script.has_label);

  step(2);
  EXPECT_FALSE(script.has_label);
}

TEST_F(LabelPropagation, DropsALabelThatLeftATrackThatTwoCamerasSee) {
  script.cameras = 2;

  step(2);

  EXPECT_FALSE(script.has_label);
}

TEST_F(LabelPropagation, DropsALabelThatAnotherTrackHas) {
  script.cameras = 1;
  script.labelled_track = TrackId{8};

  step(2);

  EXPECT_FALSE(script.has_label);
  EXPECT_FALSE(script.has_bearing);
}

TEST_F(LabelPropagation, SearchesABearingOnlyMarkerWhereTheMoreCertainSkeletonPredictsIt) {
  script.labelled_track = kTrack;
  step();
  EXPECT_EQ(script.position, kPredictedByTrack);
  script.labelled_track = {};
  script.cameras = 1;

  step(2);

  EXPECT_EQ(script.position, kPredictedByBody);
}

}  // namespace label_propagation_test
}  // namespace mocap::fusion
