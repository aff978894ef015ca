#include "bridges/natnet/request.h"

#include <gtest/gtest.h>

#include <string>

#include "bridges/natnet/command.h"

namespace mocap::natnet {
namespace {

std::string packet(std::uint16_t number, const std::string& payload) {
  return std::string{static_cast<char>(number & 255U), static_cast<char>(number >> 8U), '\7', '\7'} + payload;
}

// CONNECT with the client's version, and from 4.0 on with the version that it wants.
std::string connect(Version own, Version wanted) {
  std::string payload = "client" + std::string(254, '\0');
  payload += {static_cast<char>(own.major), static_cast<char>(own.minor), '\0', '\0'};
  if (wanted.major != 0)
    payload += {'\1', static_cast<char>(wanted.major), static_cast<char>(wanted.minor), '\0', '\0'};
  return packet(0, payload);
}

TEST(ReadNatNetRequest, TakesTheVersionThatAClientAsksFor) {
  EXPECT_EQ(read_request(connect({3, 1}, {4, 1}))->wanted, (Version{4, 1}));
  EXPECT_TRUE(read_request(connect({3, 1}, {4, 1}))->subscribed_only);
  EXPECT_EQ(read_request(connect({4, 0}, {0, 0}))->wanted, (Version{4, 0}));
  EXPECT_EQ(read_request(packet(0, ""))->wanted, std::nullopt);
  EXPECT_EQ(read_request(packet(0, "Ping"))->wanted, std::nullopt);
}

TEST(ReadNatNetRequest, IgnoresTheDeclaredSizeAndTextBehindAZeroByte) {
  EXPECT_EQ(read_request(packet(2, "FrameRate"))->text, "FrameRate");
  EXPECT_EQ(read_request(packet(2, std::string("FrameRate\0rest", 14)))->text, "FrameRate");
  EXPECT_EQ(read_request(packet(2, ""))->text, "");
  EXPECT_EQ(read_request(packet(12, std::string("\1\0\0\0\0\0\0\0", 8)))->stamp, 1U);
}

TEST(ReadNatNetRequest, RefusesWhatNoClientSends) {
  EXPECT_FALSE(read_request(""));
  EXPECT_FALSE(read_request(std::string("\0\0\0", 3)));
  EXPECT_FALSE(read_request(packet(7, "frame")));
  EXPECT_FALSE(read_request(packet(12, "short")));
  EXPECT_FALSE(read_request(packet(4711, "")));
}

TEST(NatNetVersion, IsTheNearestThatIsNotNewer) {
  EXPECT_EQ(nearest({4, 4}), (Version{4, 1}));
  EXPECT_EQ(nearest({3, 9}), (Version{3, 1}));
  EXPECT_EQ(nearest({2, 9}), (Version{3, 0}));
  EXPECT_EQ(read_version("4.1.0.0"), (Version{4, 1}));
  for (const char* text : {"", "4", "4.", "a.b", "4.1x", "999.1", "-1.0"}) EXPECT_FALSE(read_version(text)) << text;
}

class NatNetCommand : public ::testing::Test {
 protected:
  Answer run(std::string_view text) { return execute(text, settings_, {.rate_hz = 120.0F, .changeable = true}); }
  Settings settings_;
};

TEST_F(NatNetCommand, SetsEachPropertyOnlyToKnownValues) {
  for (const char* text :
       {"SetProperty,,Up Axis,Z-Axis", "SetProperty,,Skeleton Coordinates,Local", "SetProperty,,Rigid Bodies,false",
        "SetProperty,Bone Naming Convention,BVH", "SetProperty,,Devices,true"}) {
    EXPECT_EQ(run(text), Answer(kDone)) << text;
  }
  EXPECT_EQ(settings_.up, UpAxis::Z);
  EXPECT_TRUE(settings_.local_bones);
  EXPECT_FALSE(settings_.bodies);
  EXPECT_EQ(settings_.naming, Naming::Bvh);
  const Settings before = settings_;
  for (const char* text : {"SetProperty,,Up Axis,X-Axis", "SetProperty,,Rigid Bodies,maybe", "SetProperty,,Colour,red",
                           "SetProperty,,", "SetProperty,node,Up Axis,Y-Axis", "SetProperty,,Up Axis,Y-Axis,more"}) {
    EXPECT_EQ(run(text), Answer(kNotPossible)) << text;
  }
  EXPECT_EQ(settings_, before);
}

TEST_F(NatNetCommand, AnswersWithTheValue) {
  EXPECT_EQ(run("FrameRate"), Answer(120.0F));
  EXPECT_EQ(run("Bitstream,9.0"), Answer(std::string("Bitstream,4.1")));
  EXPECT_EQ(run("Bitstream"), Answer(std::string("Bitstream,4.1")));
  EXPECT_EQ(run("Bitstream,new"), Answer(kNotPossible));
  EXPECT_EQ(run("GetProperty,,Labeled Markers"), Answer(std::string("true")));
  EXPECT_EQ(run("StartRecording"), Answer(kNotPossible));
  EXPECT_EQ(run("SetRecordTakeName,walk"), Answer(kNotPossible));
  EXPECT_EQ(run("Dance"), Answer(Unknown{}));
  EXPECT_EQ(run(""), Answer(Unknown{}));
  EXPECT_EQ(run("Disconnect"), Answer(Leave{}));
}

TEST_F(NatNetCommand, OrdersTakesWhereClientsMayRecord) {
  const auto record = [&](std::string_view text) { return execute(text, settings_, {.records = true}); };

  EXPECT_EQ(record("StartRecording"), Answer(Record{true, ""}));
  EXPECT_EQ(record("SetRecordTakeName,walk 3"), Answer(kDone));
  EXPECT_EQ(record("StartRecording"), Answer(Record{true, "walk 3"}));
  EXPECT_EQ(record("StopRecording"), Answer(Record{false, ""}));
  EXPECT_EQ(record("SetRecordTakeName"), Answer(kNotPossible));
  EXPECT_EQ(record("SetRecordTakeName," + std::string(201, 'x')), Answer(kNotPossible));
}

TEST_F(NatNetCommand, SubscribesToABoundedNumberOfSubjects) {
  EXPECT_EQ(run("SubscribeToData,RigidBody,wand"), Answer(kDone));
  EXPECT_TRUE(wants(settings_, Kind::Body, "wand", 1));
  EXPECT_FALSE(wants(settings_, Kind::Body, "other", 2));
  EXPECT_FALSE(wants(settings_, Kind::Skeleton, "wand", 1));
  EXPECT_EQ(run("SubscribeByID,Skeleton,x"), Answer(kNotPossible));
  EXPECT_EQ(run("SubscribeByID,Skeleton,3"), Answer(kDone));
  EXPECT_TRUE(wants(settings_, Kind::Skeleton, "any", 3));
  EXPECT_EQ(run("SubscribeToData,RigidBody," + std::string(255, 'x')), Answer(kDone));
  EXPECT_EQ(run("SubscribeToData,RigidBody," + std::string(256, 'x')), Answer(kNotPossible));
  for (int i = 0; i < 1000; ++i) run("SubscribeToData,RigidBody,all");
  EXPECT_LE(settings_.subscriptions.size(), 256U);
  EXPECT_EQ(run("SubscribeToData,AllTypes,None"), Answer(kDone));
  EXPECT_TRUE(wants(settings_, Kind::Body, "other", 2));
}

TEST(NatNetMulticast, RefusesChangesOfOneClientForAll) {
  Settings settings;
  const Settings before = settings;
  for (const char* text : {"SetProperty,,Up Axis,Z-Axis", "Bitstream,4.1", "SubscribeToData,RigidBody,wand"}) {
    EXPECT_EQ(execute(text, settings, {.rate_hz = 0.0F, .changeable = false}), Answer(kNotPossible)) << text;
  }
  EXPECT_EQ(settings, before);
}

}  // namespace
}  // namespace mocap::natnet
