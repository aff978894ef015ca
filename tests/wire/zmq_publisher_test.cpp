#include "wire/zmq_publisher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zmq.h>

#include <memory>
#include <set>
#include <string>
#include <thread>

#include "mocap/v1/event.pb.h"
#include "mocap/v1/preview.pb.h"
#include "mocap/v1/sightings.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "random_model.h"
#include "sample_description.h"
#include "wire/codec/decode.h"
#include "wire/codec/lite.h"
#include "wire/zmq_subscriber.h"

namespace mocap::wire {
namespace zmq_publisher_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using testing::RandomModel;
using testing::sample_description;

constexpr Duration kLong = seconds(20);  // time limit of a failing test

std::unique_ptr<ZmqPublisher> publisher_at(const std::string& endpoint, std::size_t subjects = 1) {
  auto opened = ZmqPublisher::open({.endpoint = endpoint, .subjects = subjects});
  EXPECT_TRUE(opened) << opened.error().message;
  return std::move(*opened);
}

std::unique_ptr<ZmqSubscriber> subscriber_with(const SubscriberSettings& settings) {
  auto opened = ZmqSubscriber::open(settings);
  EXPECT_TRUE(opened) << opened.error().message;
  return std::move(*opened);
}

std::unique_ptr<ZmqSubscriber> subscriber_to(const std::string& endpoint, int queue = 1000) {
  SubscriberSettings settings;
  settings.endpoint = endpoint;
  settings.receive_queue = queue;
  return subscriber_with(settings);
}

// Publishes snapshots every 2 ms and health every 50 snapshots, until destroyed.
class Daemon {
 public:
  explicit Daemon(const std::string& endpoint = "tcp://127.0.0.1:*") : publisher_(publisher_at(endpoint)) {
    EXPECT_TRUE(publisher_->describe(sample_description(5)));
    thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
  }
  const std::string& endpoint() const { return publisher_->endpoint(); }

 private:
  void run(const std::stop_token& stop) {
    Snapshot snapshot;
    while (!stop.stop_requested()) {
      ++snapshot.number;
      EXPECT_TRUE(publisher_->publish(snapshot));
      if (snapshot.number % 50 == 0) {
        EXPECT_TRUE(publisher_->report({}));
      }
      std::this_thread::sleep_for(milliseconds(2));  // the rate of the feed; the test does not wait here
    }
  }

  std::unique_ptr<ZmqPublisher> publisher_;
  std::jthread thread_;
};

Result<FeedMessage> first_of(ZmqSubscriber& subscriber, const std::string& topic) {
  while (true) {
    Result<FeedMessage> got = subscriber.next(kLong);
    if (!got || got->topic == topic) return got;
  }
}

v1::Snapshot snapshot_in(const FeedMessage& message) {
  v1::Snapshot snapshot;
  EXPECT_TRUE(snapshot.ParseFromString(message.payload));
  return snapshot;
}

TEST(ZmqPublisher, SendsTheDescriptionFirstToLateSubscribers) {
  Daemon daemon;

  for (int join = 0; join < 100; ++join) {
    const auto subscriber = subscriber_to(daemon.endpoint());
    const Result<FeedMessage> first = subscriber->next(kLong);

    ASSERT_TRUE(first) << "join " << join;
    ASSERT_EQ(first->topic, "description") << "join " << join;
    v1::Description description;
    ASSERT_TRUE(description.ParseFromString(first->payload));
    EXPECT_EQ(description.version(), 5U);
  }
}

TEST(ZmqPublisher, SendsTheNewDescriptionAsWelcomeMessage) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  ASSERT_TRUE(publisher->describe(sample_description(1)));
  ASSERT_TRUE(publisher->describe(sample_description(2)));

  const auto subscriber = subscriber_to(publisher->endpoint());
  Result<FeedMessage> first = subscriber->next(milliseconds(1));
  while (!first) {
    ASSERT_TRUE(publisher->report({}));
    first = subscriber->next(milliseconds(5));
  }

  v1::Description description;
  ASSERT_TRUE(description.ParseFromString(first->payload));
  EXPECT_EQ(description.version(), 2U);
}

TEST(ZmqPublisher, SendsWholeSnapshotsInOrder) {
  Daemon daemon;
  const auto subscriber = subscriber_to(daemon.endpoint());

  const Result<FeedMessage> first = first_of(*subscriber, "snapshot");
  ASSERT_TRUE(first);
  std::uint64_t sequence = snapshot_in(*first).sequence();
  for (int i = 0; i < 20; ++i) {
    const Result<FeedMessage> next = first_of(*subscriber, "snapshot");
    ASSERT_TRUE(next);
    const v1::Snapshot snapshot = snapshot_in(*next);
    EXPECT_EQ(snapshot.sequence(), ++sequence);
    EXPECT_EQ(snapshot.number(), sequence + 1);
    EXPECT_TRUE(snapshot.has_utc_minus_host_ns());
  }
}

TEST(ZmqPublisher, WorksOverIpc) {
  const std::string path = "/tmp/mocap_wire_test_" + std::to_string(::getpid());
  {
    Daemon daemon("ipc://" + path);
    const auto subscriber = subscriber_to("ipc://" + path);
    EXPECT_TRUE(first_of(*subscriber, "health"));
    EXPECT_TRUE(first_of(*subscriber, "snapshot"));

    const auto second = ZmqPublisher::open({.endpoint = "ipc://" + path});
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::Busy);
  }
  ::unlink(path.c_str());
}

TEST(ZmqPublisher, FailsIfTheEndpointIsInUse) {
  const auto first = publisher_at("tcp://127.0.0.1:*");

  const auto second = ZmqPublisher::open({.endpoint = first->endpoint()});

  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::Busy);
  EXPECT_THAT(second.error().message, HasSubstr(first->endpoint()));
  EXPECT_THAT(second.error().message, HasSubstr("another program listens there"));
}

TEST(ZmqPublisher, NamesTheFaultInItsSettings) {
  EXPECT_EQ(ZmqPublisher::open({.endpoint = "tcp://0.0.0.0:*"}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(ZmqPublisher::open({.endpoint = "tcp://192.0.2.1:*", .allow_remote = true}).error().code,
            ErrorCode::NotFound);
  EXPECT_EQ(ZmqPublisher::open({.send_queue = 0}).error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(make_zmq_publisher({.endpoint = "nonsense"}).error().code, ErrorCode::InvalidArgument);
}

TEST(ZmqPublisher, SetsSentAtOnlyIfTheOtherInstantsAreKnown) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  Snapshot replayed;
  Snapshot live;
  const Timestamp now = host_now();
  live.instants = {now, now, now, now, std::nullopt};

  ASSERT_TRUE(publisher->publish(replayed));
  ASSERT_TRUE(publisher->publish(live));

  EXPECT_FALSE(replayed.instants.sent_at);
  ASSERT_TRUE(live.instants.sent_at);
  EXPECT_GE(*live.instants.sent_at, now);
}

TEST(ZmqPublisher, DoesNotWaitForAStalledSubscriber) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  ASSERT_TRUE(publisher->describe(sample_description()));
  const auto stalled = subscriber_to(publisher->endpoint(), 1);
  while (!stalled->next(milliseconds(5))) ASSERT_TRUE(publisher->report({}));  // until it has joined
  RandomModel random(21);
  Snapshot large = random.snapshot(kMaxLabels);

  const Timestamp start = host_now();
  for (int i = 0; i < 5000; ++i) ASSERT_TRUE(publisher->publish(large));

  // About 10 us each; a publisher that waits for the subscriber would never finish.
  EXPECT_LT(host_now() - start, seconds(30));
  Result<FeedMessage> got = stalled->next(milliseconds(200));
  int received = 0;
  while (got) {
    ++received;
    got = stalled->next(milliseconds(200));
  }
  EXPECT_LT(received, 5000);  // the other messages were dropped
}

// One frame set sends more messages on all topics together than the default send queue holds.
TEST(ZmqPublisher, LosesNoTopicOfASubscriberToAllTopics) {
  constexpr std::uint64_t kSets = 100;
  const auto publisher = publisher_at("tcp://127.0.0.1:*", kMaxSubjects);
  SubscriberSettings all{.endpoint = publisher->endpoint(), .topics = {"description", "snapshot", "markers"}};
  Description crowd = sample_description();
  crowd.subjects.resize(kMaxSubjects, crowd.subjects.front());
  for (std::size_t i = 0; i < kMaxSubjects; ++i) {
    crowd.subjects[i].name = "actor " + std::to_string(i);
    all.topics.push_back(kSubjectTopic + crowd.subjects[i].name);
  }
  ASSERT_TRUE(publisher->describe(crowd));
  const auto subscriber = subscriber_with(all);
  while (publisher->feed().subscriptions < all.topics.size()) publisher->serve();
  Snapshot snapshot = RandomModel(24).snapshot();

  for (std::uint64_t set = 0; set < kSets; ++set) {
    ASSERT_TRUE(publisher->publish(snapshot));
    std::set<std::string> received_topics;
    while (received_topics.size() < kMaxSubjects + 2) {
      const Result<FeedMessage> got = subscriber->next(kLong);
      ASSERT_TRUE(got) << "set " << set << ": " << received_topics.size() << " topics";
      if (got->topic == "description") continue;
      ASSERT_EQ(snapshot_in(*got).sequence(), set) << got->topic;
      received_topics.insert(got->topic);
    }
  }
}

TEST(ZmqPublisher, LosesNoneOfManySimultaneousEvents) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  Description ring = sample_description();
  ring.cameras.resize(kMaxCameras, ring.cameras.front());
  ASSERT_TRUE(publisher->describe(ring));
  const auto subscriber =
      subscriber_with({.endpoint = publisher->endpoint(), .topics = {"description", "snapshot", "health", "event"}});
  while (publisher->feed().subscriptions < 4) publisher->serve();
  Health dark;
  dark.cameras.resize(kMaxCameras);
  for (CameraHealth& camera : dark.cameras) camera.phase = CameraPhase::Silent;

  ASSERT_TRUE(publisher->report(dark));
  for (std::uint32_t camera = 0; camera < kMaxCameras; ++camera) {
    const Result<FeedMessage> got = first_of(*subscriber, "event");
    ASSERT_TRUE(got) << "camera " << camera;
    v1::Event event;
    ASSERT_TRUE(event.ParseFromString(got->payload));
    EXPECT_EQ(event.kind(), v1::EVENT_KIND_CAMERA_LOST);
    EXPECT_EQ(event.camera(), camera);
    publisher->serve();
  }
}

// Hostile ZeroMQ peers: subscriptions to random bytes, messages that are not subscriptions, and far too long messages.
TEST(ZmqPublisher, SurvivesHostilePeers) {
  Daemon daemon;
  const auto witness = subscriber_to(daemon.endpoint());
  ASSERT_TRUE(first_of(*witness, "snapshot"));
  RandomModel random(22);
  void* context = zmq_ctx_new();
  for (int peer = 0; peer < 20; ++peer) {
    void* socket = zmq_socket(context, ZMQ_XSUB);
    const int linger_ms = 100;
    zmq_setsockopt(socket, ZMQ_LINGER, &linger_ms, sizeof(linger_ms));
    ASSERT_EQ(zmq_connect(socket, daemon.endpoint().c_str()), 0);
    for (int i = 0; i < 50; ++i) {
      std::string bytes(random.up_to(i == 0 ? 100000 : 300), '\0');
      for (char& byte : bytes) byte = static_cast<char>(random.up_to(255));
      if (!bytes.empty() && random.coin()) bytes[0] = '\1';  // a subscription
      zmq_send(socket, bytes.data(), bytes.size(), ZMQ_DONTWAIT);
    }
    zmq_close(socket);
  }
  zmq_ctx_term(context);

  const auto newcomer = subscriber_to(daemon.endpoint());

  EXPECT_EQ(newcomer->next(kLong)->topic, "description");
  for (int i = 0; i < 50; ++i) EXPECT_TRUE(first_of(*witness, "snapshot"));
}

TEST(ZmqPublisher, ClosesAtOnceWithAStalledSubscriber) {
  auto publisher = publisher_at("tcp://127.0.0.1:*");
  ASSERT_TRUE(publisher->describe(sample_description()));
  const auto stalled = subscriber_to(publisher->endpoint(), 1);
  while (!stalled->next(milliseconds(5))) ASSERT_TRUE(publisher->report({}));
  RandomModel random(23);
  Snapshot large = random.snapshot(kMaxLabels);
  for (int i = 0; i < 2000; ++i) ASSERT_TRUE(publisher->publish(large));

  const Timestamp start = host_now();
  publisher.reset();

  EXPECT_LT(host_now() - start, seconds(1));
}

TEST(ZmqPublisher, SendsPreviewsOfACameraOnlyWhileSomebodyWantsThem) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  Description description = sample_description(5);
  ASSERT_FALSE(description.cameras.empty());
  ASSERT_TRUE(publisher->describe(description));
  const std::string topic = kPreviewTopic + description.cameras[0].name;
  Preview preview;
  preview.head.camera = CameraId{0};
  preview.head.number = 9;
  preview.head.image_width_px = 1280;
  preview.head.step = 2;
  preview.head.blobs.push_back({1.5F, 2.5F, 30.0F});
  preview.jpeg = {std::byte{1}, std::byte{0}, std::byte{2}};
  EXPECT_FALSE(publisher->wants_preview(CameraId{0}));
  EXPECT_TRUE(publisher->send_preview(preview));

  const auto subscriber = subscriber_with({.endpoint = publisher->endpoint(), .topics = {topic}});
  while (!publisher->wants_preview(CameraId{0})) {
    publisher->serve();
    static_cast<void>(subscriber->next(milliseconds(1)));
  }
  EXPECT_FALSE(publisher->wants_preview(CameraId{1}));
  EXPECT_FALSE(publisher->wants_preview(CameraId{9999}));
  ASSERT_TRUE(publisher->send_preview(preview));

  const auto message = subscriber->next(kLong);
  ASSERT_TRUE(message);
  v1::Preview sent;
  ASSERT_TRUE(sent.ParseFromString(message->payload));
  EXPECT_EQ(sent.sequence(), 0U) << "the one before had no subscriber";
  EXPECT_EQ(sent.frame_number(), 9U);
  EXPECT_EQ(sent.step(), 2U);
  EXPECT_EQ(sent.jpeg(), std::string("\1\0\2", 3));
  EXPECT_EQ(sent.x_px(0), 1.5F);
  EXPECT_EQ(sent.y_px(0), 2.5F);
}

TEST(ZmqPublisher, SendsSightingsOfTheMarkersThatArePlacedOnlyWhileSomebodyWantsThem) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  ASSERT_TRUE(publisher->describe(sample_description(5)));
  Snapshot snapshot;
  snapshot.number = 7;
  snapshot.description_version = 5;
  snapshot.instants.exposed_at = from_ns(12'000);
  SubjectLabels& labels = snapshot.labels.push_back({});
  labels.subject = SubjectId{0};
  labels.markers.push_back({});  // lost
  LabelledMarker& filled = labels.markers.push_back({});
  filled.state = LabelState::Filled;
  filled.position.v = {1.0, 2.0, 3.0};
  filled.covariance_m2 << 6.0, 1.0, 2.0, 1.0, 5.0, 3.0, 2.0, 3.0, 4.0;
  filled.seen_by = bit_of(CameraId{63});
  snapshot.unlabelled.push_back({TrackId{41}, {{4.0, 5.0, 6.0}}, 0.1, 2, bit_of(CameraId{0}) | bit_of(CameraId{2})});
  ASSERT_TRUE(publisher->publish(snapshot));

  const auto subscriber = subscriber_with({.endpoint = publisher->endpoint(), .topics = {kSightingsTopic}});
  while (publisher->feed().subscriptions < 1) publisher->serve();
  ASSERT_TRUE(publisher->publish(snapshot));

  const auto message = subscriber->next(kLong);
  ASSERT_TRUE(message);
  v1::Sightings sent;
  ASSERT_TRUE(sent.ParseFromString(message->payload));
  EXPECT_EQ(sent.sequence(), 1U);
  EXPECT_EQ(sent.number(), 7U);
  EXPECT_EQ(sent.description_version(), 5U);
  EXPECT_EQ(sent.exposed_at_ns(), 12'000);
  EXPECT_THAT(sent.subjects_plus_one(), ::testing::ElementsAre(1, 0));
  EXPECT_THAT(sent.markers(), ::testing::ElementsAre(1, 42));
  EXPECT_THAT(sent.filled(), ::testing::ElementsAre(true, false));
  EXPECT_THAT(sent.positions_m(), ::testing::ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_THAT(sent.covariances_m2(), ::testing::ElementsAre(6, 1, 2, 5, 3, 4, 1, 0, 0, 1, 0, 1));
  EXPECT_THAT(sent.seen_by(), ::testing::ElementsAre(std::uint64_t{1} << 63U, 0b101U));
}

Lite lite_in(const FeedMessage& message) {
  Lite lite;
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(message.payload.data());
  EXPECT_TRUE(decode_lite({bytes, message.payload.size()}, lite));
  return lite;
}

// A snapshot of one subject with so many bones, which stand at their rest offsets.
Snapshot snapshot_with_bones(RandomModel& random, const Description& description, std::size_t bones) {
  Snapshot snapshot;
  snapshot.description_version = description.version;
  snapshot.labels.push_back({.subject = SubjectId{0}, .phase = SubjectPhase::Tracking, .markers = {}});
  SubjectPose& pose = snapshot.poses.push_back({});
  pose.subject = SubjectId{0};
  for (std::size_t i = 0; i < bones; ++i) {
    BonePose& bone = pose.bones.push_back({});
    bone.state = BoneState::Measured;
    bone.world_from_bone = {random.vector(), random.rotation()};
    bone.parent_from_bone.position =
        i == 0 ? bone.world_from_bone.position : description.subjects[0].marker_set.skeleton.bones[i].rest_offset_m;
  }
  return snapshot;
}

// A publisher with one subject of so many bones, and a subscriber to its lite topic.
struct LiteFeed {
  Description description = sample_description(5);
  std::unique_ptr<ZmqPublisher> publisher = publisher_at("tcp://127.0.0.1:*");
  std::unique_ptr<ZmqSubscriber> subscriber;
  std::int64_t exposed_ns = 1'000'000'000;

  explicit LiteFeed(std::size_t bones = 2, const std::string& topic = "lite/actor") {
    std::vector<Bone>& all = description.subjects[0].marker_set.skeleton.bones;
    for (std::size_t i = all.size(); i < bones; ++i) {
      Bone bone = all.back();
      bone.name += "x";
      bone.parent = static_cast<int>(i) - 1;
      all.push_back(bone);
    }
    EXPECT_TRUE(publisher->describe(description));
    subscriber = subscriber_with({.endpoint = publisher->endpoint(), .topics = {topic}});
    while (publisher->feed().subscriptions < 1) publisher->serve();
  }

  // Publishes a snapshot of the next exposure at this rate.
  void publish(Snapshot& snapshot, int rate_hz) {
    exposed_ns += 1'000'000'000 / rate_hz;
    snapshot.instants.exposed_at = from_ns(exposed_ns);
    EXPECT_TRUE(publisher->publish(snapshot));
  }
};

TEST(ZmqPublisher, SendsLiteMessagesOfTheSamePoses) {
  LiteFeed feed;
  RandomModel random(41);
  Snapshot snapshot = snapshot_with_bones(random, feed.description, 2);
  snapshot.number = 77;
  snapshot.poses[0].bones[1].state = BoneState::Lost;

  feed.publish(snapshot, 30);
  const auto message = feed.subscriber->next(kLong);

  ASSERT_TRUE(message);
  EXPECT_EQ(message->topic, "lite/actor");
  const Lite lite = lite_in(*message);
  EXPECT_EQ(lite.number, 77U);
  EXPECT_EQ(lite.description_version, 5U);
  EXPECT_EQ(lite.phase, v1::SUBJECT_PHASE_TRACKING);
  EXPECT_FALSE(lite.off_rest);
  ASSERT_EQ(lite.bone_count, 2U);
  EXPECT_TRUE(lite.bones[1].lost);
  const auto& q = lite.bones[0].rotation_xyzw;
  EXPECT_LT(
      Eigen::Quaterniond(q[3], q[0], q[1], q[2]).angularDistance(snapshot.poses[0].bones[0].world_from_bone.rotation),
      1.6e-4);  // 0.0086 degrees, see proto/lite
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(lite.root_m[static_cast<std::size_t>(i)], snapshot.poses[0].bones[0].world_from_bone.position[i], 6e-5);
  }
  // The clock may be adjusted while the test runs.
  EXPECT_NEAR(static_cast<double>(lite.exposed_at_utc_ns - feed.exposed_ns - utc_minus_host().count()), 0.0, 1e9);
}

TEST(ZmqPublisher, SaysIfAJointIsNotAtItsRestOffset) {
  LiteFeed feed;
  RandomModel random(42);
  Snapshot snapshot = snapshot_with_bones(random, feed.description, 2);
  snapshot.poses[0].bones[1].parent_from_bone.position.x() += 0.01;

  feed.publish(snapshot, 30);
  const auto message = feed.subscriber->next(kLong);

  ASSERT_TRUE(message);
  EXPECT_TRUE(lite_in(*message).off_rest);
}

TEST(ZmqPublisher, SendsLiteMessagesAtTheirRate) {
  LiteFeed feed(2, "lite/*");
  RandomModel random(43);
  Snapshot snapshot = snapshot_with_bones(random, feed.description, 2);
  std::vector<Lite> received;
  const auto read = [&](Duration patience) {
    const auto message = feed.subscriber->next(patience);
    if (message) received.push_back(lite_in(*message));
    return static_cast<bool>(message);
  };

  for (; snapshot.number < 120; ++snapshot.number) {  // one second
    feed.publish(snapshot, 120);
    while (received.size() < snapshot.number / 4) ASSERT_TRUE(read(kLong));  // or a full send queue drops messages
  }
  while (received.empty() || received.back().number < 115) ASSERT_TRUE(read(kLong));

  EXPECT_NEAR(static_cast<double>(received.size()), 30.0, 1.0);  // RateLimit begins with one more
  for (std::size_t i = 0; i < received.size(); ++i) EXPECT_EQ(received[i].sequence, i);
}

TEST(ZmqPublisher, SplitsASubjectOfManyBonesIntoSeveralLiteMessages) {
  LiteFeed feed(kMaxBones);
  RandomModel random(44);
  Snapshot snapshot = snapshot_with_bones(random, feed.description, kMaxBones);

  feed.publish(snapshot, 30);

  std::size_t bones = 0;
  for (std::uint32_t i = 0; bones < kMaxBones; ++i) {
    const auto message = feed.subscriber->next(kLong);
    ASSERT_TRUE(message) << bones << " bones";
    EXPECT_LE(message->payload.size(), 200U);
    const Lite lite = lite_in(*message);
    EXPECT_EQ(lite.sequence, i);
    EXPECT_EQ(lite.first_bone, bones);
    EXPECT_EQ(lite.subject_bones, kMaxBones);
    bones += lite.bone_count;
  }
}

TEST(ZmqPublisher, SendsALiteMessageWithoutBonesOfASubjectThatIsLost) {
  LiteFeed feed;
  Snapshot snapshot;
  snapshot.labels.push_back({.subject = SubjectId{0}, .phase = SubjectPhase::Lost, .markers = {}});

  feed.publish(snapshot, 30);
  const auto message = feed.subscriber->next(kLong);

  ASSERT_TRUE(message);
  EXPECT_EQ(lite_in(*message).phase, v1::SUBJECT_PHASE_LOST);
  EXPECT_EQ(lite_in(*message).subject_bones, 0);
}

TEST(ZmqSubscriber, ReportsWhetherItIsConnected) {
  const auto publisher = publisher_at("tcp://127.0.0.1:*");
  const auto subscriber = subscriber_to(publisher->endpoint());
  while (!subscriber->link().connected) (void)subscriber->next(milliseconds(5));

  EXPECT_EQ(subscriber->link().connections, 1U);
  EXPECT_EQ(ZmqSubscriber::open({.endpoint = "nonsense"}).error().code, ErrorCode::InvalidArgument);
}

TEST(ZmqSubscriber, ChangesItsTopicsWithinOneConnection) {
  const Daemon daemon;
  const auto subscriber = subscriber_with({.endpoint = daemon.endpoint(), .topics = {"health"}});
  ASSERT_TRUE(first_of(*subscriber, "health"));

  ASSERT_TRUE(subscriber->subscribe({"snapshot"}));

  EXPECT_TRUE(first_of(*subscriber, "snapshot"));
  while (first_of(*subscriber, "snapshot")->topic != "snapshot") continue;
  EXPECT_EQ(subscriber->link().connections, 1U);
}

TEST(ZmqSubscriber, ReconnectsAfterARestartOfTheDaemon) {
  auto daemon = std::make_unique<Daemon>();
  const std::string endpoint = daemon->endpoint();
  const auto subscriber = subscriber_to(endpoint);
  ASSERT_TRUE(first_of(*subscriber, "snapshot"));

  daemon.reset();
  while (subscriber->link().connected) (void)subscriber->next(milliseconds(5));
  daemon = std::make_unique<Daemon>(endpoint);

  EXPECT_TRUE(first_of(*subscriber, "snapshot"));
  // The event "connected" may arrive after the first message of the connection.
  for (int i = 0; i < 400 && subscriber->link().connections < 2; ++i) (void)subscriber->next(milliseconds(5));
  EXPECT_EQ(subscriber->link().connections, 2U);
}

}  // namespace zmq_publisher_test
}  // namespace mocap::wire
