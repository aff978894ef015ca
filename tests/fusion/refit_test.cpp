#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "fusion/fusion.h"
#include "fusion/idle_parts.h"
#include "kinematics/pose_fit.h"
#include "support/archived.h"
#include "support/test_body.h"

namespace mocap::fusion {
namespace refit_test {

constexpr SubjectId kSubject{0};

// Returns the fit in `next`, once, as the fit of its labels.
class FittingLabeller : public IdleLabeller {
 public:
  explicit FittingLabeller(std::optional<SubjectFit>& next) : next_(next) {}
  const Labelling& label(const TrackedMarkers&, const Predictions&) override {
    labelling_.fit = std::exchange(next_, std::nullopt);
    return labelling_;
  }

 private:
  std::optional<SubjectFit>& next_;
  Labelling labelling_;
};

// Solves one person who stands in T-pose.
class TPoseSolver : public IdleSolver {
 public:
  explicit TPoseSolver(const MarkerSet& set) {
    const kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
    solved_.labels.push_back({kSubject, SubjectPhase::Tracking, {}});
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      LabelledMarker& label = solved_.labels[0].markers.push_back({});
      label.state = LabelState::Measured;
      label.position.v = body.marker_at(m);
      label.covariance_m2 = 1e-8 * Eigen::Matrix3d::Identity();
    }
    solved_.poses.push_back({kSubject, {}, 0.0});
    for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
      BonePose& bone = solved_.poses[0].bones.push_back({});
      bone.world_from_bone = body.world()[b];
      bone.parent_from_bone = body.locals()[b];
    }
  }
  const SolvedSubjects& solve(const Labels&, Timestamp, std::span<const LabelledBearing>,
                              std::span<const AmbiguousObservation>) override {
    return solved_;
  }

 private:
  SolvedSubjects solved_;
};

// A person in T-pose whose markers are 10 mm lower than in the body model that the fusion gets.
class FusionRefit : public testing::Test {
 protected:
  FusionRefit() : set(test::person("baseline41")) {
    fit.subject = kSubject;
    for (const Bone& bone : set.skeleton.bones) fit.rest_offsets_m.push_back(bone.rest_offset_m);
    for (const MarkerOnBone& marker : set.markers)
      fit.marker_offsets_m.push_back(marker.offset_m + Eigen::Vector3d(0.0, 0.0, 0.01));
  }

  std::unique_ptr<Fusion> make_fusion(bool refines) {
    FusionParts parts = make_idle_parts();
    parts.labeller = std::make_unique<FittingLabeller>(identified);
    parts.solver = std::make_unique<TPoseSolver>(set);
    if (refines)
      parts.refiner =
          std::make_unique<solve::SubjectRefiner>(solve::RefineSettings{}, std::vector<Subject>{{"somebody", set}});
    return std::make_unique<Fusion>(std::move(parts), 1);
  }

  // The number of fits that come into use in these sets.
  int fits_in(Fusion& fusion, int sets) {
    int fits = 0;
    for (int i = 0; i < sets; ++i) {
      FrameSet frames;
      frames.number = number_++;
      frames.exposed_at = from_ns(1'000'000'000) + from_s(static_cast<double>(frames.number) / 120.0);
      (void)fusion.step(frames);
      fits += fusion.fit() ? 1 : 0;
    }
    return fits;
  }

  MarkerSet set;
  SubjectFit fit;
  std::optional<SubjectFit> identified;  // the labeller gives this fit in the next set

 private:
  std::uint64_t number_ = 0;
};

TEST_F(FusionRefit, FitsABodyThatWasIdentifiedInTPoseToTheRestPose) {
  const auto fusion = make_fusion(true);
  identified = fit;

  EXPECT_EQ(fits_in(*fusion, 120), 2);
}

TEST_F(FusionRefit, EndsTheFitInWorkOfASubjectThatIsReset) {
  const auto fusion = make_fusion(true);
  identified = fit;
  ASSERT_EQ(fits_in(*fusion, 3), 1);

  fusion->reset(kSubject);

  EXPECT_EQ(fits_in(*fusion, 120), 0);
}

// The subject may be in any pose when an operator gives the fit.
TEST_F(FusionRefit, DoesNotFitABodyThatAnOperatorGaveToTheRestPose) {
  const auto fusion = make_fusion(true);

  fusion->refit(fit);

  EXPECT_EQ(fits_in(*fusion, 120), 1);
}

TEST_F(FusionRefit, DoesNotFitABodyThatWasTrackedBeforeAReloadToTheRestPose) {
  const auto before = make_fusion(false);
  identified = fit;
  ASSERT_EQ(fits_in(*before, 3), 1);
  const auto now = make_fusion(true);

  now->adopt(*before, {.subjects = {kSubject}, .cameras = {CameraId{0}}});

  EXPECT_EQ(fits_in(*now, 120), 0);
}

// Three orders between two sets: two of them for one subject, of which the later counts.
TEST_F(FusionRefit, UsesTheLastFitOfEachSubjectAlsoAfterTheBeliefIsTakenOver) {
  const auto before = make_fusion(false);
  SubjectFit other = fit;
  other.subject = SubjectId{1};
  before->refit(fit);
  before->refit(other);
  fit.residual_m = 0.007;
  before->refit(fit);
  const auto now = make_fusion(false);

  ASSERT_TRUE(test::take_over(test::archived(*before), *now));

  for (const auto& fusion : {before.get(), now.get()}) {
    ASSERT_EQ(fits_in(*fusion, 1), 1);
    EXPECT_EQ(fusion->fit()->subject, other.subject);
    ASSERT_EQ(fits_in(*fusion, 1), 1);
    EXPECT_EQ(fusion->fit()->subject, kSubject);
    EXPECT_EQ(fusion->fit()->residual_m, 0.007);
    EXPECT_EQ(fits_in(*fusion, 1), 0);
  }
}

}  // namespace refit_test
}  // namespace mocap::fusion
