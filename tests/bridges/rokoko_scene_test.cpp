#include "bridges/rokoko/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lz4frame.h>

#include <cmath>
#include <random>

#include "bridges/frames.h"
#include "bridges/rokoko/bones.h"
#include "bridges/rokoko/lz4_frame.h"
#include "support/places.h"

namespace mocap::rokoko {
namespace {

using bridge::testing::axis_vectors;
using bridge::testing::feed_pose;
using bridge::testing::TestFrame;
using bridge::testing::TestSubject;
using nlohmann::json;

json scene_of(const std::vector<TestSubject>& subjects, const SceneOptions& options = {}) {
  const TestFrame frame(subjects, MOCAP_AXES_UNITY);
  EXPECT_TRUE(frame.filled());
  return json::parse(write_scene(&frame.get(), options, 1.0));
}

std::vector<float> rotation_xyzw(const json& bone) {
  return {bone.at("rotation").at("x"), bone.at("rotation").at("y"), bone.at("rotation").at("z"),
          bone.at("rotation").at("w")};
}

std::vector<float> position(const json& bone) {
  return {bone.at("position").at("x"), bone.at("position").at("y"), bone.at("position").at("z")};
}

// A quaternion and its negative are the same rotation.
void expect_same_rotation(const std::vector<float>& found, const std::vector<float>& expected,
                          const std::string& what) {
  float cosine = 0.0F;
  for (std::size_t k = 0; k < 4; ++k) cosine += found[k] * expected[k];
  const float sign = cosine < 0.0F ? -1.0F : 1.0F;
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(found[k], sign * expected[k], 1e-5F) << what;
}

TEST(RokokoScene, WithoutAFeedHasNobody) {
  EXPECT_EQ(write_scene(nullptr, {.rate_hz = 60.0}, 1.5),
            R"({"version":3,"fps":60,"scene":{"timestamp":1.500000,"actors":[],"characters":[],"props":[]}})");
}

TEST(RokokoScene, WritesAProp) {
  const TestFrame frame({{.name = "a \"sword\"", .bones = {{"Body", "", -1}}, .poses = {{0.25, 0.5, 1, 0, 0, 0, 1}}}},
                        MOCAP_AXES_UNITY);

  EXPECT_EQ(write_scene(&frame.get(), {.rate_hz = 30.0}, 1.5),
            R"({"version":3,"fps":30,"scene":{"timestamp":5.250000,"actors":[],"characters":[],"props":[)"
            R"({"name":"a \"sword\"","color":[128,128,128],"type":0,"position":{"x":-0.5,"y":1,"z":0.25},)"
            R"("rotation":{"x":0,"y":0,"z":0,"w":1}}]}})");
}

TEST(RokokoScene, HasAll23BonesOfABodyWithoutFingers) {
  const json actor = scene_of({TestSubject{}}).at("scene").at("actors").at(0);

  EXPECT_EQ(actor.at("name"), "actor");
  EXPECT_EQ(actor.at("body").size(), 23U);
  EXPECT_EQ(actor.at("meta").at("hasGloves"), false);
  EXPECT_EQ(actor.at("meta").at("hasBody"), true);
  EXPECT_EQ(actor.at("color").size(), 3U);
}

TEST(RokokoScene, HasTheHandOnTheSideThatHasFingers) {
  const TestSubject subject{.bones = {{"Hips", "Hips", -1}, {"f", "LeftIndexProximal", 0}},
                            .poses = {{0, 0, 1, 0, 0, 0, 1}, {0, 1, 1, 0, 0, 0, 1}}};

  const json actor = scene_of({subject}).at("scene").at("actors").at(0);

  EXPECT_EQ(actor.at("meta").at("hasLeftGlove"), true);
  EXPECT_EQ(actor.at("meta").at("hasRightGlove"), false);
  EXPECT_EQ(actor.at("body").size(), 43U);
  EXPECT_EQ(position(actor.at("body").at("leftIndexTip")), (std::vector<float>{-1, 1, 0}));
}

TEST(RokokoScene, ALostBoneMovesWithTheBoneAbove) {
  const TestSubject subject{.bones = {{"Hips", "Hips", -1}, {"Spine", "Spine", 0}, {"Head", "Head", 1}},
                            .poses = {{0, 0, 1, 0, 0, 0, 1}, {0, 0, 1.25, 0, 0, 1, 0}, {9, 9, 9, 0, 0, 0, 1}},
                            .lost = {2}};

  const json body = scene_of({subject}).at("scene").at("actors").at(0).at("body");

  EXPECT_EQ(position(body.at("head")), position(body.at("spine")));
  expect_same_rotation(rotation_xyzw(body.at("head")), rotation_xyzw(body.at("spine")), "both have the same rest");
}

TEST(RokokoScene, OmitsAPersonWhoseHipsAreLost) {
  const TestSubject subject{.bones = {{"Hips", "Hips", -1}, {"Spine", "Spine", 0}},
                            .poses = {{9, 9, 9, 0, 0, 0, 1}, {0, 0, 1.25, 0, 0, 0, 1}},
                            .lost = {0}};

  EXPECT_TRUE(scene_of({subject}).at("scene").at("actors").empty());
}

TEST(RokokoScene, OmitsSubjectsThatAreNotTrackedOrNotWanted) {
  TestSubject lost;
  lost.name = "lost";
  lost.poses.clear();
  TestSubject other;
  other.name = "other";

  EXPECT_EQ(scene_of({TestSubject{}, lost, other}).at("scene").at("actors").size(), 2U);
  const json only = scene_of({TestSubject{}, lost, other}, {.subject = "other"}).at("scene").at("actors");
  ASSERT_EQ(only.size(), 1U);
  EXPECT_EQ(only.at(0).at("name"), "other");
}

TEST(RokokoScene, HeightsAreThoseOfTheRestPose) {
  const TestSubject subject{.bones = {{"Hips", "Hips", -1}, {"Spine", "Spine", 0}, {"Head", "Head", 1}},
                            .poses = {{0, 0, 1, 0, 0, 0, 1}, {0, 0, 1, 0, 0, 0, 1}, {0, 0, 1, 0, 0, 0, 1}}};

  const json size = scene_of({subject}).at("scene").at("actors").at(0).at("dimensions");

  EXPECT_EQ(size.at("totalHeight"), 0.5);  // each bone is 0.25 m above its parent
  EXPECT_EQ(size.at("hipHeight"), 0.0);    // no leg
}

TEST(RokokoScene, WritesTheAxisVectors) {
  for (const auto& vector : axis_vectors(support::source_folder())) {
    const std::string name = vector.at("rokoko").at("bone");
    TestSubject subject{.bones = {{"Hips", "Hips", -1}}, .poses = {feed_pose(vector)}};
    for (const Bone& bone : all_bones()) {
      if (bone.name != name || name == "hip") continue;
      subject.bones.push_back({std::string(bone.name), std::string(bone.unity_name), 0});
      subject.poses.push_back(feed_pose(vector));
    }

    const json found = scene_of({subject}).at("scene").at("actors").at(0).at("body").at(name);

    EXPECT_EQ(position(found), vector.at("rokoko").at("position").get<std::vector<float>>()) << vector.at("name");
    expect_same_rotation(rotation_xyzw(found), vector.at("rokoko").at("rotation_xyzw"), vector.at("name"));
  }
}

TEST(RokokoScene, NumbersAreTheFloatsOfTheClient) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> metres(-5.0F, 5.0F);
  for (int i = 0; i < 200; ++i) {
    const TestSubject subject{.poses = {{metres(random), metres(random), metres(random), 0, 0, 0, 1}}};
    const TestFrame frame({subject}, MOCAP_AXES_UNITY);
    const mocap_vec3 expected = frame.get().subject(0)->bone_poses()[0].position;

    const json body = json::parse(write_scene(&frame.get(), {}, 0)).at("scene").at("actors").at(0).at("body");

    EXPECT_EQ(position(body.at("hip")), (std::vector<float>{expected.x, expected.y, expected.z}));
  }
}

TEST(RokokoBones, ParentsComeFirstAndRestRotationsAreUnitQuaternions) {
  const auto bones = all_bones();
  ASSERT_EQ(bones.size(), 63U);
  for (std::size_t i = 0; i < bones.size(); ++i) {
    const mocap_quat q = bones[i].rest;
    EXPECT_LT(bones[i].parent, static_cast<int>(i)) << bones[i].name;
    EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0F, 1e-4F) << bones[i].name;
  }
}

TEST(Lz4Frame, IsReadByTheLibraryAndBeginsWithTheMagicNumber) {
  const std::string text = write_scene(nullptr, {}, 2.0) + std::string(5000, ' ');

  const std::string packet = lz4_frame(text);

  EXPECT_EQ(packet.substr(0, 4), "\x04\x22\x4d\x18");
  EXPECT_LT(packet.size(), 300U);
  LZ4F_dctx* context = nullptr;
  ASSERT_EQ(LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)), 0U);
  std::string again(text.size() + 1, '\0');
  std::size_t written = again.size();
  std::size_t read = packet.size();
  EXPECT_EQ(LZ4F_decompress(context, again.data(), &written, packet.data(), &read, nullptr), 0U);  // 0: the frame ended
  LZ4F_freeDecompressionContext(context);
  EXPECT_EQ(again.substr(0, written), text);
}

}  // namespace
}  // namespace mocap::rokoko
