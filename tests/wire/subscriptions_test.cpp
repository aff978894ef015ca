#include "wire/subscriptions.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace mocap::wire {
namespace subscriptions_test {

using Verdict = Subscriptions::Verdict;
using namespace std::string_literals;

Subscriptions with_two_topics() {
  Subscriptions subscriptions;
  subscriptions.set_topics({"snapshot\0"s, "health\0"s});
  return subscriptions;
}

// 20 connections, each with its maximum of 256 prefixes: together more than the limit of all prefixes.
Subscriptions full() {
  Subscriptions subscriptions = with_two_topics();
  for (int connection = 0; connection < 20; ++connection) {
    for (int i = 0; i < 256; ++i) {
      const std::string junk = "\1junk" + std::to_string(connection) + "." + std::to_string(i);
      static_cast<void>(subscriptions.take(junk, connection));
    }
  }
  return subscriptions;
}

TEST(Subscriptions, WantATopicWhileAPrefixMatches) {
  Subscriptions subscriptions = with_two_topics();

  EXPECT_FALSE(subscriptions.wanted(0));
  static_cast<void>(subscriptions.take("\1snap", 5));
  EXPECT_TRUE(subscriptions.wanted(0));
  EXPECT_FALSE(subscriptions.wanted(1));
  static_cast<void>(
      subscriptions.take("\0snap"s, -1));  // ZeroMQ does not report the connection of the last unsubscribe
  EXPECT_FALSE(subscriptions.wanted(0));
}

TEST(Subscriptions, RejectMalformedMessages) {
  Subscriptions subscriptions = with_two_topics();

  EXPECT_EQ(subscriptions.take("snapshot", 5), Verdict::NoSubscription);
  EXPECT_EQ(subscriptions.take("", 5), Verdict::NoSubscription);
  EXPECT_EQ(subscriptions.take("\1", 5), Verdict::Fine);  // all topics
}

TEST(Subscriptions, AcceptAnExistingTopicWhenFull) {
  Subscriptions subscriptions = full();
  ASSERT_EQ(subscriptions.take("\1more junk", 100), Verdict::TooMany);

  EXPECT_EQ(subscriptions.take("\1snapshot\0"s, 101), Verdict::Fine);

  EXPECT_TRUE(subscriptions.wanted(0));
}

TEST(Subscriptions, AcceptALongPrefixOnlyOfAnExistingTopic) {
  const std::string name(1000, 'a');
  Subscriptions subscriptions;
  subscriptions.set_topics({"subject/" + name + '\0'});

  EXPECT_EQ(subscriptions.take("\1subject/" + name, 5), Verdict::Fine);
  EXPECT_TRUE(subscriptions.wanted(0));
  EXPECT_EQ(subscriptions.take("\1subject/" + std::string(249, 'b'), 5), Verdict::TooMany);
  EXPECT_EQ(subscriptions.take("\1subject/" + std::string(248, 'b'), 5), Verdict::Fine);
}

TEST(Subscriptions, ResetTheLimitsOfAReusedDescriptor) {
  Subscriptions subscriptions = with_two_topics();
  Verdict verdict = Verdict::Fine;
  for (int i = 0; i < 10000 && verdict == Verdict::Fine; ++i) verdict = subscriptions.take("\1health", 5);
  ASSERT_EQ(verdict, Verdict::TooMany);

  subscriptions.forget(5);

  EXPECT_EQ(subscriptions.take("\1snapshot", 5), Verdict::Fine);
}

}  // namespace subscriptions_test
}  // namespace mocap::wire
