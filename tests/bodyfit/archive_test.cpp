#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <vector>

#include "bodyfit/subject_fitter.h"
#include "support/archived.h"
#include "support/test_body.h"

namespace mocap::bodyfit {
namespace archive_test {

// Random poses of a body that is 5 % larger than the file and has its markers elsewhere.
std::vector<BodyInstant> instants_of(const MarkerSet& file, std::size_t count) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal(0.0, 0.005);
  MarkerSet set = file;
  for (Bone& bone : set.skeleton.bones) bone.rest_offset_m *= 1.05;
  for (MarkerOnBone& marker : set.markers)
    marker.offset_m += Eigen::Vector3d(normal(random), normal(random), normal(random));
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  std::vector<BodyInstant> instants(count, empty_instant(file));
  for (BodyInstant& instant : instants) {
    const std::vector<Pose> locals = test::random_pose(set, 0.6, random);
    body.set_locals(locals);
    for (std::size_t m = 0; m < instant.seen_m.size(); ++m)
      instant.seen_m[m] = body.marker_at(m) + 0.1 * Eigen::Vector3d(normal(random), normal(random), normal(random));
    instant.locals = locals;
  }
  return instants;
}

// A fitter with the instants of its fit.
struct Fit {
  Fit(const MarkerSet& file, std::size_t count)
      : instants(count, empty_instant(file)), fitter(file, OffsetPriors{}, count) {}

  void archive(Archive& members) {
    members(fitter);
    fitter.archive_fit(members, instants);
  }

  std::vector<BodyInstant> instants;
  SubjectFitter fitter;
};

// A fit that is replaced after each step by a new one with its belief gives the same offsets.
TEST(Archive, LetsAFitContinueAfterEachStep) {
  const MarkerSet file = test::person("openmocap18");
  constexpr std::size_t kInstants = 12, kFitted = 10;
  Fit fit(file, kInstants);
  fit.instants = instants_of(file, kInstants);
  fit.fitter.begin(offsets_of(file), 1.0, std::span(fit.instants).first(kFitted));
  bool is_done = false;
  int steps = 0;
  for (auto other = std::make_unique<Fit>(file, kInstants); !is_done; ++steps) {
    const std::vector<std::byte> before = test::archived(fit);
    other = std::make_unique<Fit>(file, kInstants);
    ASSERT_TRUE(test::take_over(before, *other)) << steps;

    is_done = fit.fitter.work();
    ASSERT_EQ(other->fitter.work(), is_done) << steps;
    ASSERT_EQ(fit.fitter.improved(), other->fitter.improved()) << steps;
    ASSERT_EQ(test::archived(fit), test::archived(*other)) << steps;
  }
  EXPECT_GT(fit.fitter.iterations(), 3);
  EXPECT_GT(steps, 100);
}

TEST(Archive, OfAFitWithMoreInstantsIsRefused) {
  const MarkerSet file = test::person("openmocap18");
  Fit fit(file, 12), other(file, 10);
  fit.instants = instants_of(file, 12);
  fit.fitter.begin(offsets_of(file), 1.0, fit.instants);

  EXPECT_FALSE(test::take_over(test::archived(fit), other));
}

}  // namespace archive_test
}  // namespace mocap::bodyfit
