// Hostile and stalled peers of a feed without authentication.
#include <gtest/gtest.h>
#include <zmq.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "sample_description.h"
#include "support/raw_tcp.h"
#include "wire/listener.h"
#include "wire/zmq_publisher.h"
#include "wire/zmq_subscriber.h"

namespace mocap::wire {
namespace hostile_test {

using std::chrono::milliseconds;
using testing::sample_description;

constexpr Duration kLong = std::chrono::seconds(60);  // time limit of a failing test

TEST(Publisher, DisconnectsAPeerWithTooManySubscriptions) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  void* context = zmq_ctx_new();
  void* hostile = zmq_socket(context, ZMQ_XSUB);
  const int off = 0;
  zmq_setsockopt(hostile, ZMQ_LINGER, &off, sizeof(off));
  ASSERT_EQ(zmq_connect(hostile, (*publisher)->endpoint().c_str()), 0);

  for (int i = 0; i < 20000 && (*publisher)->feed().cut_off == 0; ++i) {
    const std::string message = '\1' + std::to_string(i);
    zmq_send(hostile, message.data(), message.size(), ZMQ_DONTWAIT);
    if (i % 100 == 0) (*publisher)->serve();
  }
  const Timestamp begun = host_now();
  while ((*publisher)->feed().cut_off == 0 && host_now() - begun < kLong) (*publisher)->serve();

  EXPECT_GE((*publisher)->feed().cut_off, 1U);
  zmq_close(hostile);
  zmq_ctx_term(context);
}

TEST(Publisher, DisconnectsAPeerThatRepeatsOneSubscriptionTooOften) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  void* context = zmq_ctx_new();
  void* hostile = zmq_socket(context, ZMQ_XSUB);
  const int off = 0;
  zmq_setsockopt(hostile, ZMQ_LINGER, &off, sizeof(off));
  ASSERT_EQ(zmq_connect(hostile, (*publisher)->endpoint().c_str()), 0);

  const Timestamp begun = host_now();
  while ((*publisher)->feed().cut_off == 0 && host_now() - begun < kLong) {
    zmq_send(hostile, "\1snapshot", 9, ZMQ_DONTWAIT);
    (*publisher)->serve();
  }

  EXPECT_GE((*publisher)->feed().cut_off, 1U);
  EXPECT_LE((*publisher)->feed().subscriptions, 1U);
  zmq_close(hostile);
  zmq_ctx_term(context);
}

TEST(Publisher, RejectsPeersOfZmtp1And2) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  ASSERT_TRUE((*publisher)->describe(sample_description()));
  support::RawTcp old((*publisher)->endpoint());
  ASSERT_TRUE(old.open());
  old.send({"\1\0\2\0\1", 5});  // ZMTP 1.0: no identity, a subscription to everything

  std::string heard;
  Snapshot snapshot;
  const Timestamp begun = host_now();
  while (old.open() && host_now() - begun < kLong) {
    ASSERT_TRUE((*publisher)->publish(snapshot));
    heard += old.receive();
  }
  while ((*publisher)->feed().failed_handshakes == 0 && host_now() - begun < kLong) (*publisher)->serve();

  EXPECT_FALSE(old.open());
  EXPECT_LE(heard.size(), 64U) << "more than a greeting";
  EXPECT_EQ((*publisher)->feed().failed_handshakes, 1U);
  EXPECT_EQ((*publisher)->feed().listeners, 0U);
}

TEST(Publisher, DisconnectsAPeerThatSendsInvalidSubscriptions) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  void* context = zmq_ctx_new();
  void* hostile = zmq_socket(context, ZMQ_XSUB);
  const int off = 0;
  zmq_setsockopt(hostile, ZMQ_LINGER, &off, sizeof(off));
  ASSERT_EQ(zmq_connect(hostile, (*publisher)->endpoint().c_str()), 0);
  zmq_send(hostile, "hello", 5, 0);

  const Timestamp begun = host_now();
  while ((*publisher)->feed().disconnections == 0 && host_now() - begun < kLong) (*publisher)->serve();

  EXPECT_EQ((*publisher)->feed().cut_off, 1U);
  EXPECT_EQ((*publisher)->feed().disconnections, 1U);
  zmq_close(hostile);
  zmq_ctx_term(context);
}

TEST(Listener, DisconnectsAPeerWhoseMessagePrecedesItsAcceptedEvent) {
  Listener listener("feed");
  ListenSettings settings;
  settings.endpoints = {"tcp://127.0.0.1:*"};
  ASSERT_TRUE(listener.open(ZMQ_XPUB, 10, settings));
  support::RawTcp hostile(listener.endpoints().front());
  hostile.subscribe_to_nothing_yet();
  hostile.send({"\0\1x", 3});
  zmq_pollitem_t readable{listener.socket().get(), 0, ZMQ_POLLIN, 0};
  ASSERT_EQ(zmq_poll(&readable, 1, 60'000), 1);
  ZmqMessage message;
  ASSERT_TRUE(message.receive(listener.socket()));

  listener.cut(message.connection(), "a test");

  EXPECT_EQ(listener.figures().cut_off, 1U);
}

TEST(Publisher, CountsAStalledSubscriber) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  ASSERT_TRUE((*publisher)->describe(sample_description()));
  support::RawTcp stalled((*publisher)->endpoint());
  stalled.subscribe_to_nothing_yet();
  stalled.send({"\0\1\1", 3});  // subscribes to all topics

  EXPECT_EQ((*publisher)->feed().behind, 0U);
  Snapshot snapshot;
  const Timestamp begun = host_now();
  for (int i = 0; host_now() - begun < kLong; ++i) {
    ASSERT_TRUE((*publisher)->publish(snapshot));
    if (i % 50 == 0 && (*publisher)->feed().behind > 0) break;
  }

  EXPECT_EQ((*publisher)->feed().behind, 1U);
}

TEST(Publisher, AcceptsASubscriberDuringAFlood) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher) << publisher.error().message;
  ASSERT_TRUE((*publisher)->describe(sample_description()));
  const std::string& endpoint = (*publisher)->endpoint();
  std::jthread flood([&endpoint](const std::stop_token& stop) {
    std::string junk;  // messages that are not subscriptions
    for (int i = 0; i < 1000; ++i) junk.append("\0\x64", 2).append(100, 'x');
    while (!stop.stop_requested()) {
      support::RawTcp stranger(endpoint);
      stranger.subscribe_to_nothing_yet();
      stranger.send(junk);
      while (stranger.open() && !stop.stop_requested()) stranger.receive();  // until the publisher disconnects it
    }
  });

  int heard = 0;
  Snapshot snapshot;
  const Timestamp begun = host_now();
  for (int join = 0; join < 20 && host_now() - begun < kLong; ++join) {
    SubscriberSettings settings;
    settings.endpoint = endpoint;
    const auto listener = std::move(*ZmqSubscriber::open(settings));
    Result<FeedMessage> got = listener->next(milliseconds(1));
    while (!(got && got->topic == "snapshot") && host_now() - begun < kLong) {
      ASSERT_TRUE((*publisher)->publish(snapshot));
      got = listener->next(milliseconds(1));
    }
    heard += got && got->topic == "snapshot" && listener->link().connections == 1 ? 1 : 0;
  }

  EXPECT_EQ(heard, 20);
  EXPECT_GE((*publisher)->feed().cut_off, 1U);
}

TEST(Publisher, ClosesTheNewestConnectionAboveTheLimit) {
  auto publisher = ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*", .max_connections = 3});
  ASSERT_TRUE(publisher) << publisher.error().message;
  ASSERT_TRUE((*publisher)->describe(sample_description()));
  std::vector<std::unique_ptr<ZmqSubscriber>> listeners;

  for (int i = 0; i < 4; ++i) {
    SubscriberSettings settings;
    settings.endpoint = (*publisher)->endpoint();
    listeners.push_back(std::move(*ZmqSubscriber::open(settings)));
    const Timestamp begun = host_now();
    const auto known = [&] { return listeners.back()->link().connected || (*publisher)->feed().cut_off > 0; };
    while (!known() && host_now() - begun < kLong) {
      (*publisher)->serve();
      static_cast<void>(listeners.back()->next(milliseconds(1)));
    }
  }
  const Timestamp begun = host_now();
  while ((*publisher)->feed().cut_off == 0 && host_now() - begun < kLong) (*publisher)->serve();

  EXPECT_GE((*publisher)->feed().cut_off, 1U);
}

}  // namespace hostile_test
}  // namespace mocap::wire
