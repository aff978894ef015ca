#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "stages/fuse.h"
#include "support/empty_row.h"

namespace mocap::stages {
namespace {

constexpr TrackId kTrack{7};
constexpr Label kName{SubjectId{0}, 2};

/// What a test says of the one marker, and what the row made of it.
struct Script {
  bool lone = false;    // one camera sees it
  bool named = false;   // its track bears the name
  bool called = false;  // the matcher was told the name
  bool ray = false;     // the solver was told a ray of that name
};

class ScriptedMatcher : public Matcher {
 public:
  explicit ScriptedMatcher(Script& script) : script_(script) {}
  const Matches& match(const FrameSet&, const Expected& expected) override {
    script_.called = expected.markers[0].label == kName;
    matches_.lone.clear();
    if (script_.lone) matches_.lone.push_back({});
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
    labels_[0].markers[kName.marker].track = script_.named ? kTrack : TrackId{};
    return labels_;
  }

 private:
  Script& script_;
  Labels labels_;
};

class ScriptedSolver : public support::EmptySolver {
 public:
  explicit ScriptedSolver(Script& script) : script_(script) {}
  const Poses& solve(Labels& labels, Timestamp at, std::span<const NamedRay> rays) override {
    script_.ray = rays.size() == 1 && rays[0].label == kName;
    return EmptySolver::solve(labels, at, rays);
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
    script.named = true;
    step(2);
    script.named = false;
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
  script.lone = true;

  step(200);

  EXPECT_TRUE(script.called);
  EXPECT_TRUE(script.ray);
}

TEST_F(FuseNames, ANameOutlivesAMomentInWhichNoCameraSeesTheMarker) {
  step(10);
  EXPECT_TRUE(script.called);
  script.lone = true;
  step();

  EXPECT_TRUE(script.ray);
}

TEST_F(FuseNames, ATrackThatNobodySawForLongHasNoNameAnyMore) {
  step(30);
  EXPECT_FALSE(script.called);
  script.lone = true;
  step();

  EXPECT_FALSE(script.ray);
}

}  // namespace
}  // namespace mocap::stages
