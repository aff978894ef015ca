#include "identify/body_pose_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include "kinematics/pose_fit.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace body_pose_search_test {

using Eigen::Vector3d;

constexpr double kClutterDensity_1_m3 = 1.0;

// The points of a person in a random pose, in random order and with clutter.
struct Scene {
  Scene(const MarkerSet& set, int clutter, std::mt19937& random) : body(set, kinematics::PoseFit::Lengths::Fixed) {
    std::normal_distribution<double> noise(0.0, 0.0005);
    std::uniform_real_distribution<double> flat(-1.0, 1.0);
    body.set_locals(test::random_pose(set, 0.6, random));
    const std::size_t count = set.markers.size() + static_cast<std::size_t>(clutter);
    std::vector<std::size_t> order(count);
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::shuffle(order.begin(), order.end(), random);
    for (const std::size_t m : order) {
      const bool is_marker = m < set.markers.size();
      Vector3d at = is_marker ? body.marker_at(m) : body.world()[0].position;
      for (double& x : at) x += is_marker ? noise(random) : flat(random);
      points.push_back(at);
      marker_of_point.push_back(is_marker ? static_cast<int>(m) : -1);
    }
    cloud.assign(points);
  }

  kinematics::PoseFit body;
  std::vector<Vector3d> points;
  std::vector<int> marker_of_point;  // -1: clutter
  pose::PointCloud cloud;
};

void finish(BodyPoseSearch& search, const pose::PointCloud& cloud, const SearchPlan& plan) {
  // One call for each point of the cloud, and one for each of at most 32 hypotheses of each step.
  std::size_t most_calls = cloud.size() + 1 + 32 * plan.size();
  while (!search.expand()) ASSERT_GT(most_calls--, 0U);
}

std::size_t wrong_labels(const BodyPoseHypothesis& hypothesis, const Scene& scene) {
  std::size_t wrong = 0;
  for (std::size_t m = 0; m < hypothesis.point_of_marker.size(); ++m) {
    const int p = hypothesis.point_of_marker[m];
    if (p >= 0 && scene.marker_of_point[static_cast<std::size_t>(p)] != static_cast<int>(m)) ++wrong;
  }
  return wrong;
}

std::size_t labels(const BodyPoseHypothesis& hypothesis) {
  return static_cast<std::size_t>(std::ranges::count_if(hypothesis.point_of_marker, [](int p) { return p >= 0; }));
}

int torso_of(const MarkerSet& set, const BodyPoseSearch& search) {
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    if (search.shapes().determines_rotation(b)) return static_cast<int>(b);
  }
  return -1;
}

TEST(BodyPoseSearch, PlansEachOtherBoneOnceFromABoneThatHasAPose) {
  const MarkerSet set = test::person("baseline41");
  const BodyPoseSearch search(set);
  for (int root = 0; root < static_cast<int>(set.skeleton.bones.size()); ++root) {
    const SearchPlan plan = search.plan_from(root);

    EXPECT_EQ(plan.size() + 1, set.skeleton.bones.size());
    std::vector<int> posed{root};
    for (const SearchStep& step : plan) {
      EXPECT_EQ(std::ranges::count(posed, step.from), 1);
      EXPECT_EQ(std::ranges::count(posed, step.bone), 0);
      posed.push_back(step.bone);
    }
  }
}

TEST(BodyPoseSearch, PlansJointsThatCoincideInRestPose) {
  const MarkerSet set = test::person("baseline41");
  kinematics::PoseFit rest(set, kinematics::PoseFit::Lengths::Fixed);
  rest.place({});
  const BodyPoseSearch search(set);

  for (const SearchStep& step : search.plan_from(3)) {
    const Vector3d one = rest.world()[static_cast<std::size_t>(step.bone)] * step.joint_in_bone_m;
    const Vector3d other = rest.world()[static_cast<std::size_t>(step.from)] * step.joint_in_neighbour_m;
    EXPECT_LT((one - other).norm(), 1e-12);  // m: rounding
  }
}

TEST(BodyPoseSearch, LabelsABodyAmongClutterAndFindsThePoseOfItsBones) {
  std::mt19937 random(21);
  const MarkerSet set = test::person("baseline41");
  BodyPoseSearch search(set);
  const int root = torso_of(set, search);
  const SearchPlan plan = search.plan_from(root);
  for (int trial = 0; trial < 5; ++trial) {
    const Scene scene(set, 6, random);
    search.begin(scene.cloud, {}, kClutterDensity_1_m3);

    search.start(root, plan);
    finish(search, scene.cloud, plan);

    ASSERT_FALSE(search.hypotheses().empty());
    const BodyPoseHypothesis& best = search.hypotheses().front();
    EXPECT_EQ(wrong_labels(best, scene), 0U) << trial;
    EXPECT_EQ(labels(best), set.markers.size()) << trial;
    for (std::size_t b = 0; b < best.bones.size(); ++b) {
      if (best.bones[b].dof != pose::Dof::Full) continue;
      // Noise of 0.5 mm on levers of 4 cm and more, in the worst of 20 bones.
      EXPECT_LT(test::angle_between(best.bones[b].world.rotation, scene.body.world()[b].rotation), 0.06);
    }
  }
}

TEST(BodyPoseSearch, OrdersItsHypothesesByCostAndUsesNoPointTwice) {
  std::mt19937 random(22);
  const MarkerSet set = test::person("openmocap18");
  BodyPoseSearch search(set);
  const int root = torso_of(set, search);
  ASSERT_GE(root, 0);
  const SearchPlan plan = search.plan_from(root);
  const Scene scene(set, 12, random);
  search.begin(scene.cloud, {}, kClutterDensity_1_m3);

  search.start(root, plan);
  finish(search, scene.cloud, plan);

  ASSERT_GE(search.hypotheses().size(), 2U);
  for (std::size_t i = 0; i < search.hypotheses().size(); ++i) {
    const BodyPoseHypothesis& one = search.hypotheses()[i];
    if (i > 0) {
      EXPECT_GE(one.cost, search.hypotheses()[i - 1].cost);
    }
    pose::UsedPoints used;
    for (const int p : one.point_of_marker) {
      if (p < 0) continue;
      EXPECT_FALSE(used.test(static_cast<std::size_t>(p)));
      used.set(static_cast<std::size_t>(p));
    }
    EXPECT_EQ(used, one.used);
  }
}

TEST(BodyPoseSearch, ContinuesAHypothesisWithTheRemainingBones) {
  std::mt19937 random(23);
  const MarkerSet set = test::person("baseline41");
  BodyPoseSearch search(set);
  const int root = torso_of(set, search);
  const SearchPlan plan = search.plan_from(root);
  const auto half = plan.begin() + static_cast<std::ptrdiff_t>(plan.size() / 2);
  const SearchPlan first_half(plan.begin(), half), second_half(half, plan.end());
  const Scene scene(set, 4, random);
  search.begin(scene.cloud, {}, kClutterDensity_1_m3);
  search.start(root, first_half);
  finish(search, scene.cloud, first_half);
  ASSERT_FALSE(search.hypotheses().empty());
  const BodyPoseHypothesis begun = search.hypotheses().front();
  ASSERT_LT(labels(begun), set.markers.size());

  search.start(begun, second_half);
  finish(search, scene.cloud, second_half);

  ASSERT_FALSE(search.hypotheses().empty());
  const BodyPoseHypothesis& best = search.hypotheses().front();
  EXPECT_EQ(labels(best), set.markers.size());
  EXPECT_EQ(wrong_labels(best, scene), 0U);
  EXPECT_LT(best.cost, begun.cost);
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    if (begun.point_of_marker[m] >= 0) {
      EXPECT_EQ(best.point_of_marker[m], begun.point_of_marker[m]);
    }
  }
}

TEST(BodyPoseSearch, EndsWithoutAHypothesisIfThereAreNoPoints) {
  const MarkerSet set = test::person("baseline41");
  BodyPoseSearch search(set);
  const SearchPlan plan = search.plan_from(0);
  const pose::PointCloud nothing;
  search.begin(nothing, {}, kClutterDensity_1_m3);

  search.start(0, plan);

  EXPECT_TRUE(search.expand());
  EXPECT_TRUE(search.hypotheses().empty());
}

TEST(BodyPoseSearch, UsesTheJointsOfTheFittedBodyAfterARefit) {
  const MarkerSet file = test::person("baseline41");
  MarkerSet fitted = file;
  for (Bone& bone : fitted.skeleton.bones) bone.rest_offset_m *= 1.2;
  BodyPoseSearch search(file);
  const int root = static_cast<int>(test::bone_named(file, "LeftLowArm"));  // the plan goes up and down the tree
  SearchPlan plan = search.plan_from(root);
  const SearchPlan expected = BodyPoseSearch(fitted).plan_from(root);

  search.refit(fitted);
  search.refit(plan);

  ASSERT_EQ(plan.size(), expected.size());
  for (std::size_t i = 0; i < plan.size(); ++i) {
    EXPECT_EQ(plan[i].bone, expected[i].bone);
    EXPECT_EQ(plan[i].joint_in_bone_m, expected[i].joint_in_bone_m);
    EXPECT_EQ(plan[i].joint_in_neighbour_m, expected[i].joint_in_neighbour_m);
  }
}

}  // namespace body_pose_search_test
}  // namespace mocap::identify
