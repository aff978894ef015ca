#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <utility>

#include "fusion/fusion.h"
#include "fusion/idle_parts.h"

namespace mocap::fusion {
namespace handover_test {

SubjectFit fit_of(SubjectId subject) {
  SubjectFit fit;
  fit.subject = subject;
  fit.residual_m = 0.001;
  return fit;
}

std::unique_ptr<Fusion> empty_fusion() { return std::make_unique<Fusion>(fusion::make_idle_parts(), 1); }

const Handover kBehindANewSubject{.subjects = {SubjectId{}, SubjectId{0}}, .cameras = {CameraId{0}}};

TEST(FusionHandover, KeepsTheFitsUnderTheNewIdsAndCountsTheVersionOn) {
  const auto before = empty_fusion();
  before->refit(fit_of(SubjectId{0}));
  const std::uint32_t version = before->step({}).description_version;
  ASSERT_EQ(before->fits().size(), 1U);

  const auto now = empty_fusion();
  now->adopt(*before, kBehindANewSubject);

  ASSERT_EQ(now->fits().size(), 1U);
  EXPECT_EQ(now->fits().front().subject, SubjectId{1});
  EXPECT_EQ(now->step({}).description_version, version + 1);
}

TEST(FusionHandover, UsesAWaitingFitUnderTheNewId) {
  const auto before = empty_fusion();
  before->refit(fit_of(SubjectId{0}));

  const auto now = empty_fusion();
  now->adopt(*before, kBehindANewSubject);
  now->step({});

  ASSERT_TRUE(now->fit().has_value());
  EXPECT_EQ(now->fit()->subject, SubjectId{1});
}

TEST(FusionHandover, ForgetsTheFitOfASubjectThatDoesNotContinue) {
  const auto before = empty_fusion();
  before->refit(fit_of(SubjectId{0}));
  before->step({});
  before->refit(fit_of(SubjectId{0}));

  const auto now = empty_fusion();
  now->adopt(*before, {.subjects = {SubjectId{}}, .cameras = {}});
  now->step({});

  EXPECT_TRUE(now->fits().empty());
  EXPECT_FALSE(now->fit().has_value());
}

// A refiner of a later configuration assumes the bones of the file otherwise.
TEST(FusionHandover, RemembersAfterALaterFitThatTheBodyMayBeOfAnotherPerson) {
  const auto fusion = empty_fusion();
  SubjectFit identified = fit_of(SubjectId{0});
  identified.at_identification = true;
  fusion->refit(identified);
  fusion->step({});
  fusion->refit(fit_of(SubjectId{0}));
  fusion->step({});

  EXPECT_FALSE(fusion->fit()->at_identification);
  EXPECT_TRUE(fusion->fits().front().at_identification);
}

}  // namespace handover_test
}  // namespace mocap::fusion
