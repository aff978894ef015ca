#include "bridges/natnet/packets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

namespace mocap::natnet {
namespace {

using ::testing::Eq;

// A packet as text: two hexadecimal digits for each byte. Floats are written by hand: 1 = 0000803f, 2 = 00000040,
// 0.5 = 0000003f, -0.5 = 000000bf (IEEE 754, little endian).
std::string hex(std::string_view packet) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char byte : packet) {
    text += kDigits[static_cast<unsigned char>(byte) >> 4U];
    text += kDigits[static_cast<unsigned char>(byte) & 15U];
  }
  return text;
}

std::string joined(std::initializer_list<std::string_view> parts) {
  std::string text;
  for (const std::string_view part : parts) text += part;
  return text;
}

constexpr std::string_view kZero = "00000000";
constexpr std::string_view kOne = "01000000";
constexpr std::string_view kFloatOne = "0000803f";
constexpr std::string_view kFloatTwo = "00000040";
constexpr std::string_view kHalf = "0000003f";
constexpr std::string_view kMinusHalf = "000000bf";

// A prop "b" with one marker "m", 1 m ahead, 2 m up; turned by 120 degrees about forward + left + up.
Scene one_prop() {
  Model model;
  model.name = "b";
  model.id = 1;
  model.error_m = 0.5F;
  model.bones.push_back({"Body", "", -1, {}});
  model.markers.push_back({"m", 0, {1.0F, 0.0F, 0.0F}});
  BonePose pose;
  pose.position = {1.0F, 0.0F, 2.0F};
  pose.rotation = {0.5F, 0.5F, 0.5F, 0.5F};
  pose.tracked = true;
  model.poses.push_back(pose);
  model.marker_poses.push_back({{1.0F, 0.0F, 0.0F}, true, true});
  Scene scene;
  scene.number = 258;
  scene.exposed_ns = 1'000'000'000;
  scene.received_ns = 1'000'000'001;
  scene.timecode = 0x01020304;
  scene.subframe = 3;
  scene.models_changed = true;
  scene.models.push_back(model);
  return scene;
}

Settings only_bodies(Version version) {
  Settings settings;
  settings.version = version;
  settings.marker_sets = settings.labelled = settings.skeletons = false;
  return settings;
}

// Seconds 1.0, exposed 1e9, received 1e9 + 1, sent 1e9 + 2.
constexpr std::string_view kInstants =
    "000000000000f03f"
    "00ca9a3b00000000"
    "01ca9a3b00000000"
    "02ca9a3b00000000";

TEST(NatNetFramePacket, OfVersion30HasThePropInYUp) {
  PacketWriter writer;

  const std::string packet = hex(frame_packet(writer, one_prop(), only_bodies({3, 0}), 1'000'000'002));

  // x left, y up, z forward
  EXPECT_EQ(packet, joined({"0700", "7400", "02010000",  // frame, 116 bytes, number 258
                            kZero, kZero,                // marker sets, other markers
                            kOne, kOne, kZero, kFloatTwo, kFloatOne, kHalf, kHalf, kHalf, kHalf, kHalf, "0100", kZero,
                            kZero, kZero, kZero,  // skeletons, labelled markers,
                                                  // force plates, devices
                            "04030201", "03000000", kInstants, "0200", kZero}));
}

TEST(NatNetFramePacket, OfVersion41HasSizesAndAPtpStampInZUp) {
  PacketWriter writer;
  Settings settings = only_bodies({4, 1});
  settings.up = UpAxis::Z;

  const std::string packet = hex(frame_packet(writer, one_prop(), settings, 1'000'000'002));

  // x left, y backward, z up
  EXPECT_EQ(packet, joined({"0700",     "a000",     "02010000", kZero,
                            kZero,      kZero,      kZero,  // each count with its size
                            kOne,       "26000000", kOne,       kZero,
                            "000080bf", kFloatTwo,  kHalf,      kMinusHalf,
                            kHalf,      kHalf,      kHalf,      "0100",
                            kZero,      kZero,      kZero,      kZero,
                            kZero,      kZero,      kZero,      kZero,
                            kZero,      kZero,  // and the assets
                            "04030201", "03000000", kInstants,  "0000000000000000",
                            "0200",     kZero}));
}

TEST(NatNetFramePacket, HasMarkerSetsAndLabelledAndUnlabelledMarkers) {
  PacketWriter writer;
  Scene scene = one_prop();
  scene.unlabelled.push_back({{0.0F, 0.0F, 1.0F}, 7});
  Settings settings;
  settings.bodies = false;
  settings.version = {3, 1};

  const std::string packet = hex(frame_packet(writer, scene, settings, 1'000'000'002));

  const std::string ahead = joined({kZero, kZero, kFloatOne});
  const std::string above = joined({kZero, kFloatOne, kZero});
  EXPECT_EQ(packet.substr(16),
            joined({"02000000", "6200",     kOne,  ahead, "616c6c00", kOne,       ahead,  // sets "b" and "all"
                    kOne,       above,                                                    // other markers
                    kZero,      kZero,                                                    // bodies, skeletons
                    "02000000", "01000100", ahead, kZero, "0a00",     kZero,      "07000000", above,  kZero,
                    "1200",     kZero,      kZero, kZero, "04030201", "03000000", kInstants,  "0200", kZero}));
}

TEST(NatNetFramePacket, HasBonesRelativeToTheParentIfAsked) {
  PacketWriter writer;
  Scene scene = one_prop();
  scene.models[0].bones.push_back({"Head", "Head", 0, {0.0F, 0.0F, 1.0F}});
  scene.models[0].poses.push_back(
      {{9.0F, 9.0F, 9.0F}, {0.0F, 0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, 1.0F}, {0.0F, 0.0F, 0.0F, 1.0F}, false});
  Settings settings = only_bodies({3, 0});
  settings.skeletons = settings.local_bones = true;

  const std::string packet = hex(frame_packet(writer, scene, settings, 0));

  EXPECT_THAT(packet, ::testing::HasSubstr(joined(
                          {"02000100", kZero, kFloatOne, kZero, kZero, kZero, kZero, kFloatOne, kHalf, "0000"})));
}

TEST(NatNetFramePacket, ThatIsTooLargeForUdpIsEmpty) {
  PacketWriter writer;
  Scene scene = one_prop();
  scene.unlabelled.resize(6000);

  EXPECT_TRUE(frame_packet(writer, scene, Settings{}, 0).empty());
  scene.unlabelled.clear();
  EXPECT_FALSE(frame_packet(writer, scene, Settings{}, 0).empty());
}

TEST(NatNetModelsPacket, DescribesAPropWithAndWithoutSizesAndMarkerNames) {
  PacketWriter writer;
  const std::string set = joined({"6200", kOne, "6d00"});
  const std::string all = joined({"616c6c00", kOne, "623a6d00"});
  const std::string body = joined({"6200", kOne, kZero, kZero, kZero, kZero, kOne, kZero, kZero, kFloatOne, kZero});

  EXPECT_EQ(hex(models_packet(writer, one_prop(), only_bodies({3, 1}))),
            joined({"0500", "4e00", "03000000", kZero, set, kOne, body, kZero, all}));
  EXPECT_EQ(hex(models_packet(writer, one_prop(), only_bodies({4, 0}))),
            joined({"0500", "5000", "03000000", kZero, set, kOne, body, "6d00", kZero, all}));
  EXPECT_EQ(hex(models_packet(writer, one_prop(), only_bodies({4, 1}))),
            joined({"0500", "5c00", "03000000", kZero, "08000000", set, kOne, "2c000000", body, "6d00", kZero,
                    "0c000000", all}));
}

TEST(NatNetModelsPacket, NamesTheBonesOfASkeletonInTheConventionOfTheClient) {
  PacketWriter writer;
  Scene scene = one_prop();
  scene.models[0].markers.clear();
  scene.models[0].bones = {{"Hips", "Hips", -1, {}}, {"Knee", "LeftLowerLeg", 0, {}}, {"Tail", "", 0, {}}};
  Settings settings = only_bodies({3, 0});
  for (const auto& [naming, names] : {std::pair{Naming::Motive, std::array{"b_Hip", "b_LShin", "b_Tail"}},
                                      std::pair{Naming::Fbx, std::array{"b_Hips", "b_LeftLeg", "b_Tail"}},
                                      std::pair{Naming::Bvh, std::array{"b_Hips", "b_LeftKnee", "b_Tail"}}}) {
    settings.naming = naming;
    const std::string packet(models_packet(writer, scene, settings));
    for (const char* name : names)
      EXPECT_NE(packet.find(std::string(1, '\0') + name + '\0'), std::string::npos) << name;
  }
}

TEST(NatNetPackets, OfTheServerHaveTheirLayout) {
  PacketWriter writer;

  const std::string info = hex(server_info_packet(writer, {{4, 1}, 1511, true, {239, 255, 42, 99}}));

  EXPECT_EQ(info.size(), 2 * 283U);
  EXPECT_EQ(info.substr(0, 24),
            "01001701"
            "6d6f636170640000");  // "mocapd"
  EXPECT_EQ(info.substr(2 * 260U),
            "00010000"
            "04010000"
            "00ca9a3b00000000"
            "e705"
            "01"
            "efff2a63");
  EXPECT_EQ(hex(echo_packet(writer, 1, 2)),
            "0d001000"
            "0100000000000000"
            "0200000000000000");
  EXPECT_EQ(hex(response_packet(writer, std::int32_t{1})),
            "03000400"
            "01000000");
  EXPECT_EQ(hex(response_packet(writer, 2.0F)),
            "03000400"
            "00000040");
  EXPECT_EQ(hex(response_packet(writer, std::string_view("Y"))),
            "03000200"
            "5900");
  EXPECT_EQ(hex(unrecognised_packet(writer)), "64000000");
}

}  // namespace
}  // namespace mocap::natnet
