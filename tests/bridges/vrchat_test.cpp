#include "bridges/vmc/vrchat.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <random>

#include "bridges/frames.h"
#include "support/places.h"

namespace mocap::vmc {
namespace {

using bridge::testing::axis_vectors;
using bridge::testing::feed_pose;
using bridge::testing::TestBone;
using bridge::testing::TestFrame;
using bridge::testing::TestSubject;

constexpr std::size_t kPacket_bytes = 1400;

std::uint32_t whole_at(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(at, 4)) value = value << 8U | static_cast<unsigned char>(byte);
  return value;
}

// The messages of three floats in OSC bundles, by address.
std::map<std::string, std::vector<float>> decode(const std::vector<std::string>& bundles) {
  std::map<std::string, std::vector<float>> found;
  for (const std::string& bundle : bundles) {
    for (std::size_t at = 16; at < bundle.size();) {
      const std::string one = bundle.substr(at + 4, whole_at(bundle, at));
      at += 4 + one.size();
      const std::string address = one.c_str();
      const std::size_t tags = address.size() / 4 * 4 + 4;
      EXPECT_EQ(one.substr(tags, 8), std::string(",fff\0\0\0\0", 8));
      for (std::size_t k = 0; k < 3; ++k) {
        found[address].push_back(std::bit_cast<float>(whole_at(one, tags + 8 + 4 * k)));
      }
    }
  }
  return found;
}

std::map<std::string, std::vector<float>> trackers(const TestSubject& subject, bool with_head = true) {
  const TestFrame frame({subject}, MOCAP_AXES_UNITY);
  EXPECT_TRUE(frame.filled());
  OscBundles bundles(kPacket_bytes);
  const auto first = frame.get().subject(0);
  write_trackers(&*first, with_head, bundles);
  return decode(bundles.bundles());
}

TestSubject body() {
  TestSubject subject{.bones = {}, .poses = {}};
  for (const char* name : {"Hips", "Spine", "Head", "LeftUpperArm", "LeftLowerArm", "RightUpperArm", "RightLowerArm",
                           "LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "RightUpperLeg", "RightLowerLeg", "RightFoot"}) {
    const auto place = static_cast<float>(subject.bones.size());
    subject.bones.push_back({name, name, static_cast<int>(subject.bones.size()) - 1});
    subject.poses.push_back({place, 0, 1, 0, 0, 0, 1});
  }
  return subject;
}

TEST(VrchatTrackers, HasEightTrackersAndTheHead) {
  const auto found = trackers(body());

  EXPECT_EQ(found.size(), 18U);
  EXPECT_EQ(found.at("/tracking/trackers/1/position"), (std::vector<float>{0, 1, 0}));
  EXPECT_EQ(found.at("/tracking/trackers/2/position"),
            (std::vector<float>{0, 1, 1}));  // the spine, as there is no chest
  EXPECT_EQ(found.at("/tracking/trackers/7/position"), (std::vector<float>{0, 1, 4}));  // elbow: the forearm's joint
  EXPECT_EQ(found.at("/tracking/trackers/head/position"), (std::vector<float>{0, 1, 2}));
}

TEST(VrchatTrackers, AKneeRotatesWithTheThigh) {
  TestSubject subject = body();
  subject.poses[7] = {0, 0, 1, 0, 0, std::sqrt(0.5F), std::sqrt(0.5F)};  // LeftUpperLeg, 90 degrees to the left

  EXPECT_NEAR(trackers(subject).at("/tracking/trackers/5/rotation")[1], -90.0F, 1e-3F);
}

TEST(VrchatTrackers, OmitsLostBonesAndTheHeadOnRequest) {
  TestSubject subject = body();
  subject.lost = {9};  // LeftFoot

  const auto found = trackers(subject, false);

  EXPECT_EQ(found.size(), 14U);
  EXPECT_FALSE(found.contains("/tracking/trackers/3/position"));
  EXPECT_FALSE(found.contains("/tracking/trackers/head/position"));
}

TEST(VrchatTrackers, ALostChestIsNotReplacedByTheSpine) {
  TestSubject subject = body();
  subject.bones.push_back({"Chest", "Chest", 1});
  subject.poses.push_back({5, 0, 1, 0, 0, 0, 1});

  EXPECT_EQ(trackers(subject).at("/tracking/trackers/2/position"), (std::vector<float>{0, 1, 5}));
  subject.lost = {subject.bones.size() - 1};
  EXPECT_FALSE(trackers(subject).contains("/tracking/trackers/2/position"));
}

TEST(VrchatTrackers, IsSilentWithoutATrackedSubject) {
  TestSubject lost = body();
  lost.poses.clear();
  OscBundles bundles(kPacket_bytes);

  write_trackers(nullptr, true, bundles);

  EXPECT_TRUE(bundles.bundles().empty());
  EXPECT_TRUE(trackers(lost).empty());
}

TEST(VrchatTrackers, SendsTheAxisVectors) {
  for (const auto& vector : axis_vectors(support::source_folder())) {
    const auto found = trackers({.poses = {feed_pose(vector)}});
    const std::vector<float> position = vector.at("vrchat").at("position");
    const std::vector<float> euler = vector.at("vrchat").at("euler_deg");
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(found.at("/tracking/trackers/1/position")[k], position[k], 1e-5F) << vector.at("name");
      // Single precision: near the pole the error of an angle is the root of that of its sine.
      EXPECT_NEAR(found.at("/tracking/trackers/1/rotation")[k], euler[k], 0.03F) << vector.at("name");
    }
  }
}

mocap_quat product(mocap_quat a, mocap_quat b) {
  return {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y, a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w, a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
}

// The oracle: VRChat composes the rotation about y, about x and about z.
mocap_quat composed(mocap_vec3 euler_deg) {
  const auto half = [](float degrees) { return degrees * std::numbers::pi_v<float> / 360.0F; };
  const mocap_quat x{std::sin(half(euler_deg.x)), 0, 0, std::cos(half(euler_deg.x))};
  const mocap_quat y{0, std::sin(half(euler_deg.y)), 0, std::cos(half(euler_deg.y))};
  const mocap_quat z{0, 0, std::sin(half(euler_deg.z)), std::cos(half(euler_deg.z))};
  return product(y, product(x, z));
}

TEST(UnityEuler, ComposesToTheRotation) {
  std::mt19937 random(1);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 2000; ++i) {
    mocap_quat q{normal(random), normal(random), normal(random), normal(random)};
    if (i % 10 == 0) q = {0.5F, normal(random) > 0 ? 0.5F : -0.5F, 0.5F, 0.5F};  // at or near the pole
    const float norm = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
    q = {q.x / norm, q.y / norm, q.z / norm, q.w / norm};

    const mocap_quat again = composed(unity_euler_deg(q));

    const float cosine = std::abs(q.x * again.x + q.y * again.y + q.z * again.z + q.w * again.w);
    EXPECT_GT(cosine, 1.0F - 1e-6F);  // an angle of 0.16 degrees
  }
}

}  // namespace
}  // namespace mocap::vmc
