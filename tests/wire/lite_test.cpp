#include "wire/codec/lite.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "support/places.h"

namespace mocap::wire {
namespace lite_test {

constexpr double kDegree = std::numbers::pi / 180.0;
// proto/lite/README.md derives this bound from the 15 bits of a component.
constexpr double kRotationBound_rad = 0.0086 * kDegree;
constexpr double kPositionBound_m = 0.00005 + 1e-9;

std::vector<std::uint8_t> encoded(const Lite& from) {
  std::array<std::uint8_t, kMaxLite_bytes> buffer{};
  const std::size_t size = encode_lite(from, buffer);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
}

Lite decoded(const std::vector<std::uint8_t>& bytes) {
  Lite into;
  EXPECT_TRUE(decode_lite(bytes, into));
  return into;
}

Lite with_bones(const std::vector<Eigen::Quaterniond>& rotations) {
  Lite lite{.phase = 2};
  lite.bone_count = rotations.size();
  lite.subject_bones = static_cast<std::uint8_t>(rotations.size());
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const auto& q = rotations[i].coeffs();
    lite.bones[i] = {.lost = false, .rotation_xyzw = {q[0], q[1], q[2], q[3]}};
  }
  return lite;
}

Eigen::Quaterniond rotation_of(const LiteBone& bone) {
  const auto& q = bone.rotation_xyzw;
  return {q[3], q[0], q[1], q[2]};
}

// Of a rotation that was encoded and decoded. Not by acos, which loses half of the digits near 1.
double error_rad(const Eigen::Quaterniond& rotation) {
  const Eigen::Quaterniond found = rotation_of(decoded(encoded(with_bones({rotation}))).bones[0]);
  const double apart = std::min((found.coeffs() - rotation.normalized().coeffs()).norm(),
                                (found.coeffs() + rotation.normalized().coeffs()).norm());
  return 4.0 * std::asin(apart / 2.0);
}

TEST(Lite, RotationsAreWithinTheStatedBound) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  double worst = 0.0;
  for (int i = 0; i < 200000; ++i) {
    Eigen::Quaterniond rotation(normal(random), normal(random), normal(random), normal(random));
    worst = std::max(worst, error_rad(rotation.normalized()));
  }

  EXPECT_LT(worst, kRotationBound_rad);
  EXPECT_GT(worst, 0.5 * kRotationBound_rad);  // the bound is not loose
}

// The error is largest where all components have the same size.
TEST(Lite, RotationsWithEqualComponentsAreWithinTheStatedBound) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0.0, 1e-4);
  for (int signs = 0; signs < 16; ++signs) {
    const auto component = [&](int bit) { return ((signs >> bit & 1) == 0 ? 0.5 : -0.5) + normal(random); };
    for (int i = 0; i < 5000; ++i) {
      ASSERT_LT(error_rad({component(0), component(1), component(2), component(3)}), kRotationBound_rad);
    }
  }
}

TEST(Lite, TheIdentityAndRotationsByHalfATurnAreExact) {
  for (int axis = 0; axis < 4; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      Eigen::Quaterniond rotation(0.0, 0.0, 0.0, 0.0);
      rotation.coeffs()[axis] = sign;
      EXPECT_EQ(error_rad(rotation), 0.0);
    }
  }
}

TEST(Lite, PositionsAreWithinATwentiethOfAMillimetre) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> coordinate(-kLiteRange_m, kLiteRange_m);
  for (int i = 0; i < 100000; ++i) {
    const Lite sent{.root_m = {coordinate(random), coordinate(random), coordinate(random)}};
    const Lite found = decoded(encoded(sent));
    ASSERT_FALSE(found.out_of_range);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_NEAR(found.root_m[k], sent.root_m[k], kPositionBound_m);
  }
}

TEST(Lite, APositionOutOfRangeIsClampedAndSaysSo) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Lite found = decoded(encoded({.root_m = {900.0, -1e300, nan}}));

  EXPECT_TRUE(found.out_of_range);
  EXPECT_EQ(found.root_m, (std::array{kLiteRange_m, -kLiteRange_m, 0.0}));
}

TEST(Lite, EveryFieldArrives) {
  Lite sent = with_bones({Eigen::Quaterniond::Identity(), Eigen::Quaterniond::Identity()});
  sent.off_rest = true;
  sent.subject_bones = 128;
  sent.first_bone = 126;
  sent.description_version = 0xFFFF'FFFE;
  sent.sequence = 0x8000'0001;
  sent.number = 0xFEDC'BA98'7654'3210;
  sent.exposed_at_utc_ns = -1'700'000'000'123'456'789;
  sent.bones[1].lost = true;

  const Lite found = decoded(encoded(sent));

  EXPECT_EQ(found.phase, 2);
  EXPECT_TRUE(found.off_rest);
  EXPECT_FALSE(found.out_of_range);
  EXPECT_EQ(found.subject_bones, 128);
  EXPECT_EQ(found.first_bone, 126);
  EXPECT_EQ(found.description_version, sent.description_version);
  EXPECT_EQ(found.sequence, sent.sequence);
  EXPECT_EQ(found.number, sent.number);
  EXPECT_EQ(found.exposed_at_utc_ns, sent.exposed_at_utc_ns);
  ASSERT_EQ(found.bone_count, 2U);
  EXPECT_FALSE(found.bones[0].lost);
  EXPECT_TRUE(found.bones[1].lost);
}

TEST(Lite, WhatIsNoRotationIsLost) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double component : {0.0, 0.1, 5.0, nan, 1e300}) {
    EXPECT_TRUE(decoded(encoded(with_bones({{component, component, component, component}}))).bones[0].lost);
  }
}

TEST(Lite, APersonOf24BonesFitsInto200Bytes) {
  const std::vector<Eigen::Quaterniond> person(24, Eigen::Quaterniond::Identity());

  EXPECT_EQ(encoded(with_bones(person)).size(), 181U);
  EXPECT_EQ(kMaxLite_bytes, 199U);
}

TEST(Lite, CountsTheMessagesOfASubject) {
  EXPECT_EQ(lite_messages(0), 1U);
  EXPECT_EQ(lite_messages(27), 1U);
  EXPECT_EQ(lite_messages(28), 2U);
  EXPECT_EQ(lite_messages(128), 5U);
}

TEST(Lite, RefusesWhatIsNoMessage) {
  const std::vector<std::uint8_t> good = encoded(with_bones({Eigen::Quaterniond::Identity()}));
  Lite into;
  ASSERT_TRUE(decode_lite(good, into));

  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_EQ(decode_lite({good.data(), size}, into), size == kLiteHeader_bytes) << size;
  }
  std::vector<std::uint8_t> other_layout = good;
  other_layout[0] = 2;
  EXPECT_FALSE(decode_lite(other_layout, into));
  std::vector<std::uint8_t> too_many = good;
  too_many[3] = 1;  // bones 1 to 1 of a subject with one
  EXPECT_FALSE(decode_lite(too_many, into));
  EXPECT_FALSE(decode_lite(std::vector<std::uint8_t>(kMaxLite_bytes + kLiteRotation_bytes, 1), into));
}

// The decoders of the clients and of the receivers read the same files.
TEST(Lite, EncodesTheVectorsOfTheProtocol) {
  for (const char* name : {"person", "prop", "lost"}) {
    std::ifstream file(support::source_folder() + "/proto/lite/" + name + ".json");
    const nlohmann::json vector = nlohmann::json::parse(file);
    Lite lite{.phase = vector["phase"], .off_rest = vector["off_rest"], .subject_bones = vector["subject_bones"]};
    lite.first_bone = vector["first_bone"];
    lite.description_version = vector["description_version"];
    lite.sequence = vector["sequence"];
    lite.number = vector["number"];
    lite.exposed_at_utc_ns = vector["exposed_at_utc_ns"];
    lite.root_m = vector["sent_root_m"];
    for (const nlohmann::json& rotation : vector["sent_rotations_xyzw"]) {
      LiteBone& bone = lite.bones[lite.bone_count++];
      bone.lost = rotation.is_null();
      if (!bone.lost) bone.rotation_xyzw = rotation;
    }

    std::string hex;
    for (const std::uint8_t byte : encoded(lite)) {
      constexpr const char* kDigits = "0123456789abcdef";
      hex += {kDigits[byte >> 4U], kDigits[byte & 15U]};
    }

    EXPECT_EQ(hex, vector["hex"]) << name;
  }
}

}  // namespace lite_test
}  // namespace mocap::wire
