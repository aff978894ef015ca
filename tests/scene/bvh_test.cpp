// The curve between frames, and the limits of a BVH file. clip_test.cpp has files of other programs.
#include "scene/bvh.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace mocap::scene {
namespace bvh_test {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::HasSubstr;

constexpr const char* kHierarchy =
    "HIERARCHY\nROOT hip\n{\n OFFSET 0 0 0\n CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n"
    " JOINT knee\n {\n  OFFSET 0 -40 0\n  CHANNELS 3 Zrotation Xrotation Yrotation\n"
    "  End Site\n  {\n   OFFSET 0 -40 0\n  }\n }\n}\n";

const std::string kFiveFrames = std::string(kHierarchy) +
                                "MOTION\nFrames: 5\nFrame Time: 0.1\n"
                                "0 90 0 0 0 0 0 0 0\n"
                                "10 91 0 20 0 5 0 30 0\n"
                                "30 90 2 35 10 5 0 50 0\n"
                                "35 88 1 30 15 0 0 55 10\n"
                                "36 88 0 10 20 0 0 20 10\n";

BvhPosture at(const Bvh& bvh, double t_s) {
  BvhPosture posture;
  posture_of(bvh, t_s, posture);
  return posture;
}

TEST(BvhPosture, GoesThroughEveryFrame) {
  const auto bvh = parse_bvh(kFiveFrames);
  ASSERT_TRUE(bvh) << bvh.error().message;

  for (int frame = 0; frame < 5; ++frame) {
    const BvhPosture posture = at(*bvh, 0.1 * frame);
    const double* values = bvh->values.data() + 9 * frame;

    EXPECT_LT((posture.root - Vector3d(values[0], values[1], values[2])).norm(), 1e-9) << frame;  // rounding, cm
    const auto rad = [&](int i) { return values[i] * 3.141592653589793 / 180.0; };
    for (int joint = 0; joint < 2; ++joint) {
      const int k = 3 + 3 * joint;
      const Quaterniond expected = Eigen::AngleAxisd(rad(k), Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(rad(k + 1), Vector3d::UnitX()) *
                                   Eigen::AngleAxisd(rad(k + 2), Vector3d::UnitY());
      // Rounding in the arc cosine of a small angle, rad.
      EXPECT_LT(posture.rotations[static_cast<std::size_t>(joint)].angularDistance(expected), 1e-6) << frame;
    }
  }
}

TEST(BvhPosture, HasAContinuousVelocityAtEachFrame) {
  const auto bvh = parse_bvh(kFiveFrames);
  ASSERT_TRUE(bvh);
  constexpr double kStep_s = 1e-5;

  for (int frame = 1; frame < 4; ++frame) {
    const BvhPosture before = at(*bvh, 0.1 * frame - kStep_s), there = at(*bvh, 0.1 * frame),
                     after = at(*bvh, 0.1 * frame + kStep_s);

    const Vector3d jump = (after.root - 2.0 * there.root + before.root) / kStep_s;
    // The acceleration is below 1e4 cm/s^2, so that the velocity changes by less than 0.1 cm/s in a step. Straight
    // lines would have jumps of 70 cm/s and more.
    EXPECT_LT(jump.norm(), 0.2) << frame;
    for (std::size_t joint = 0; joint < 2; ++joint) {
      const Quaterniond in = before.rotations[joint].conjugate() * there.rotations[joint];
      const Quaterniond out = there.rotations[joint].conjugate() * after.rotations[joint];
      EXPECT_LT(2.0 * (out.vec() - in.vec()).norm() / kStep_s, 0.02) << frame;  // rad/s; straight arcs: 0.8 and more
    }
  }
}

TEST(BvhPosture, StandsStillBeforeTheFirstAndAfterTheLastFrame) {
  const auto bvh = parse_bvh(kFiveFrames);
  ASSERT_TRUE(bvh);

  EXPECT_EQ(at(*bvh, -1.0).root, Vector3d(0, 90, 0));
  EXPECT_LT((at(*bvh, 100.0).root - Vector3d(36, 88, 0)).norm(), 1e-9);
}

TEST(BvhPosture, OfASingleFrameIsConstant) {
  const auto bvh = parse_bvh(fmt::format("{}MOTION\nFrames: 1\nFrame Time: 0.1\n1 2 3 90 0 0 0 0 0\n", kHierarchy));
  ASSERT_TRUE(bvh) << bvh.error().message;

  for (const double t_s : {0.0, 0.05, 3.0}) EXPECT_LT((at(*bvh, t_s).root - Vector3d(1, 2, 3)).norm(), 1e-12);
}

TEST(ParseBvh, GivesTheTreeWithoutEndSites) {
  const auto bvh = parse_bvh(kFiveFrames);

  ASSERT_TRUE(bvh);
  ASSERT_EQ(bvh->joints.size(), 2U);
  EXPECT_EQ(bvh->joints[0].name, "hip");
  EXPECT_EQ(bvh->joints[0].parent, -1);
  EXPECT_EQ(bvh->joints[1].name, "knee");
  EXPECT_EQ(bvh->joints[1].parent, 0);
  EXPECT_EQ(bvh->joints[1].offset, Vector3d(0, -40, 0));
  EXPECT_EQ(bvh->joints[1].first_value, 6U);
  EXPECT_EQ(bvh->values_a_frame, 9U);
  EXPECT_EQ(bvh->frames, 5U);
}

TEST(ParseBvh, NamesLineAndReasonOfAFault) {
  const auto fault_of = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    const auto bvh = parse_bvh(text);
    EXPECT_FALSE(bvh);
    return bvh ? std::string() : bvh.error().message;
  };

  EXPECT_THAT(fault_of(kFiveFrames, "Zposition", "Wposition"), HasSubstr("BVH line 5: unknown channel 'Wposition'"));
  EXPECT_THAT(fault_of(kFiveFrames, "0 -40 0", "0 x 0"), HasSubstr("BVH line 8: expected three numbers after OFFSET"));
  EXPECT_THAT(fault_of(kFiveFrames, "Frames: 5", "Frames: 0"), HasSubstr("at least 1"));
  EXPECT_THAT(fault_of(kFiveFrames, "Frames: 5", "Frames: 99999999999"), HasSubstr("number of frames"));
  EXPECT_THAT(fault_of(kFiveFrames, "Time: 0.1", "Time: 0"), HasSubstr("frame time above 0 s"));
  EXPECT_THAT(fault_of(kFiveFrames, "91 0 20", "91 nan 20"), HasSubstr("BVH line 20: expected a number"));
}

}  // namespace bvh_test
}  // namespace mocap::scene
