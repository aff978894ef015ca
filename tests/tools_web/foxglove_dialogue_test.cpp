#include "web/foxglove/foxglove_dialogue.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "web/foxglove/foxglove_messages.h"

namespace mocap::web {
namespace foxglove_dialogue_test {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr Timestamp kStart = from_ns(1'000'000'000);

// A dialogue with a hub that has the feed of one subject and the given cameras.
class FoxgloveDialogueTest : public testing::Test {
 protected:
  FoxgloveDialogueTest() {
    describe({"north"});
    dialogue_.emplace(hub_, Connection{.wake = [] {},
                                       .cut = [this](const std::string& reason) { cut_ = reason; },
                                       .note_refused = [this](const std::string&) { ++refused_; },
                                       .hold = [] { return nullptr; },
                                       .topics_changed = [] {}});
  }

  void describe(const std::vector<std::string>& cameras) {
    v1::Description description;
    for (const std::string& name : cameras) description.add_cameras()->set_name(name);
    hub_.take({{"description", description.SerializeAsString()}}, kStart);
  }

  void feed_snapshot(std::int64_t exposed_at_ns) {
    v1::Snapshot snapshot;
    snapshot.mutable_instants()->set_exposed_at_ns(exposed_at_ns);
    hub_.take({{"snapshot", snapshot.SerializeAsString()}}, kStart);
  }

  // The texts that wait; binary messages are skipped.
  std::vector<json> texts() {
    std::vector<json> all;
    while (auto message = dialogue_->next()) {
      if (!message->binary) all.push_back(json::parse(*message->bytes));
    }
    return all;
  }
  std::vector<std::string> binaries() {
    std::vector<std::string> all;
    while (auto message = dialogue_->next()) {
      if (message->binary) all.push_back(*message->bytes);
    }
    return all;
  }

  std::uint32_t channel(const std::string& topic) {
    for (const json& text : texts()) {
      if (text["op"] != "advertise") continue;
      for (const json& each : text["channels"]) known_[each["topic"]] = each["id"];
    }
    return known_.at(topic);
  }

  void say(const json& message) { dialogue_->take(message.dump(), true); }
  void subscribe(std::uint32_t id, const std::string& topic) {
    say({{"op", "subscribe"}, {"subscriptions", {{{"id", id}, {"channelId", channel(topic)}}}}});
  }

  Hub hub_{"tcp://127.0.0.1:5570", kStart};
  std::map<std::string, std::uint32_t> known_;
  std::string cut_;
  int refused_ = 0;
  std::optional<FoxgloveDialogue> dialogue_;
};

TEST_F(FoxgloveDialogueTest, BeginsWithTheServerAndItsChannels) {
  const auto said = texts();

  EXPECT_EQ(said.at(0)["op"], "serverInfo");
  EXPECT_EQ(said.at(0)["capabilities"], json::array());
  std::vector<std::string> topics;
  for (const json& text : said) {
    if (text["op"] != "advertise") continue;
    for (const json& each : text["channels"]) {
      topics.push_back(each["topic"]);
      EXPECT_EQ(each["encoding"], "protobuf");
      EXPECT_THAT(each["schemaName"].get<std::string>(), testing::StartsWith("foxglove."));
      EXPECT_FALSE(each["schema"].get<std::string>().empty());
    }
  }
  EXPECT_THAT(topics, testing::UnorderedElementsAre("/tf", "/scene", "/tf/cameras", "/preview/north"));
}

TEST_F(FoxgloveDialogueTest, RefusesDeepNestingWithoutRecursion) {
  constexpr int kDepth = 1'000'000;
  texts();

  dialogue_->take(R"({"op":"subscribe","subscriptions":)" + std::string(kDepth, '[') + std::string(kDepth, ']') + "}",
                  true);

  EXPECT_EQ(refused_, 1);
  EXPECT_THAT(texts().at(0)["message"].get<std::string>(), HasSubstr("expected the operation"));
}

TEST_F(FoxgloveDialogueTest, SendsASubscribedChannelWithIdAndTime) {
  subscribe(258, "/scene");
  feed_snapshot(0x0102030405060708);

  const auto messages = binaries();

  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0].substr(0, 13), std::string("\x01\x02\x01\x00\x00\x08\x07\x06\x05\x04\x03\x02\x01", 13));
  foxglove::SceneUpdate scene;
  EXPECT_TRUE(scene.ParseFromString(messages[0].substr(13)));
  EXPECT_EQ(scene.entities_size(), 1);
}

TEST_F(FoxgloveDialogueTest, GivesThePosesOfCamerasTheTimeOfThisMachine) {
  subscribe(1, "/tf/cameras");
  v1::Health health;  // of a daemon on another machine, which started at another time
  health.set_utc_minus_host_ns(1);
  hub_.take({{"health", health.SerializeAsString()}}, kStart);
  describe({"north"});

  const auto messages = binaries();

  ASSERT_EQ(messages.size(), 1U);
  foxglove::FrameTransforms cameras;
  ASSERT_TRUE(cameras.ParseFromString(messages[0].substr(13)));
  const std::int64_t utc_s = to_ns(host_now() + utc_minus_host()) / 1'000'000'000;
  EXPECT_NEAR(static_cast<double>(cameras.transforms(0).timestamp().seconds()), static_cast<double>(utc_s), 600.0);
}

TEST_F(FoxgloveDialogueTest, SendsNoImageBeforeItKnowsTheTimeOfTheDaemon) {
  subscribe(1, "/preview/north");
  v1::Preview preview;
  preview.set_exposed_at_ns(5);
  hub_.take({{"preview/north", preview.SerializeAsString()}}, kStart);
  EXPECT_THAT(binaries(), ElementsAre());

  v1::Health health;
  health.set_utc_minus_host_ns(3'000'000'000);
  hub_.take({{"health", health.SerializeAsString()}, {"preview/north", preview.SerializeAsString()}}, kStart);

  const auto messages = binaries();
  ASSERT_EQ(messages.size(), 1U);
  foxglove::CompressedImage image;
  ASSERT_TRUE(image.ParseFromString(messages[0].substr(13)));
  EXPECT_EQ(image.timestamp().seconds(), 3);
}

TEST_F(FoxgloveDialogueTest, WantsOnlyTheTopicsOfItsSubscriptions) {
  EXPECT_FALSE(hub_.topics().contains("snapshot"));
  subscribe(1, "/preview/north");
  EXPECT_TRUE(hub_.topics().contains("preview/north"));
  EXPECT_FALSE(hub_.topics().contains("snapshot"));

  say({{"op", "unsubscribe"}, {"subscriptionIds", {1}}});

  EXPECT_FALSE(hub_.topics().contains("preview/north"));
}

TEST_F(FoxgloveDialogueTest, KeepsTheNewestSnapshotAndCountsTheOthers) {
  subscribe(1, "/tf");
  for (const std::int64_t at : {1, 2, 3}) feed_snapshot(at);

  const auto messages = binaries();

  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0][5], 3);
  EXPECT_EQ(hub_.dropped_snapshots(), 2U);
}

TEST_F(FoxgloveDialogueTest, OffersAndWithdrawsTheImagesOfCamerasThatChange) {
  const std::uint32_t north = channel("/preview/north");
  subscribe(1, "/preview/north");

  describe({"south"});

  const auto said = texts();
  ASSERT_EQ(said.size(), 2U);
  EXPECT_EQ(said[0], (json{{"op", "unadvertise"}, {"channelIds", {north}}}));
  EXPECT_EQ(said[1]["channels"][0]["topic"], "/preview/south");
  describe({"south", "north"});
  EXPECT_EQ(texts().at(0)["channels"][0]["id"], north) << "the same channel has the same id";
}

TEST_F(FoxgloveDialogueTest, WarnsAboutWhatItCannotExecute) {
  texts();
  for (const char* message :
       {R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})", R"({"op":"subscribe","subscriptions":[{}]})",
        R"({"op":"subscribe","subscriptions":[7]})", R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":[5]})", R"({"op":"unsubscribe","subscriptionIds":["x"]})"}) {
    dialogue_->take(message, true);
    const auto said = texts();
    ASSERT_EQ(said.size(), 1U) << message;
    EXPECT_EQ(said[0]["op"], "status");
    EXPECT_EQ(said[0]["level"], 1);
  }
}

TEST_F(FoxgloveDialogueTest, CountsMessagesOfAnotherForm) {
  for (const char* message : {"", "[]", "{", R"({"op":7})", R"({"op":"advertise","channels":[]})", R"({"a":1})"}) {
    dialogue_->take(message, true);
  }
  dialogue_->take(R"({"op":"subscribe"})", false);

  EXPECT_EQ(refused_, 7);
}

TEST_F(FoxgloveDialogueTest, BoundsTheSubscriptionsOfAClient) {
  const std::uint32_t scene = channel("/scene");
  json many = json::array();
  for (int id = 0; id < 200; ++id) many.push_back({{"id", id}, {"channelId", scene}});
  say({{"op", "subscribe"}, {"subscriptions", many}});
  feed_snapshot(1);
  EXPECT_EQ(cut_, "slow") << "more warnings than a client that reads would let wait";

  EXPECT_LE(binaries().size(), 96U);
}

TEST_F(FoxgloveDialogueTest, IgnoresMessagesOfTheFeedThatAreNoMessages) {
  subscribe(1, "/scene");
  subscribe(2, "/preview/north");
  hub_.take({{"snapshot", "\xff\xff"}, {"preview/north", "\xff\xff"}}, kStart);

  EXPECT_THAT(binaries(), ElementsAre());
}

TEST_F(FoxgloveDialogueTest, SaysWhyThereIsNoData) {
  texts();
  dialogue_->note_time(kStart + from_s(5.0));
  dialogue_->note_time(kStart + from_s(6.0));
  const auto said = texts();
  ASSERT_EQ(said.size(), 1U);
  EXPECT_THAT(said[0]["message"].get<std::string>(), HasSubstr("tcp://127.0.0.1:5570"));

  wire::LinkStatus link;
  link.connected = true;
  hub_.note_link(link);
  feed_snapshot(1);
  dialogue_->note_time(kStart);
  EXPECT_EQ(texts().at(0)["level"], 0);
}

}  // namespace foxglove_dialogue_test
}  // namespace mocap::web
