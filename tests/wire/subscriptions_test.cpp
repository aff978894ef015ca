#include "wire/subscriptions.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

namespace mocap::wire {
namespace {

using Verdict = Subscriptions::Verdict;
using namespace std::string_literals;

Subscriptions with_two_topics() {
  Subscriptions subscriptions;
  subscriptions.set_topics({"snapshot\0"s, "health\0"s});
  return subscriptions;
}

// So many strangers, each with as many prefixes as one may have, that nothing more is kept.
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

TEST(Subscriptions, WantATopicAsLongAsSomePrefixBeginsIt) {
  Subscriptions subscriptions = with_two_topics();

  EXPECT_FALSE(subscriptions.wanted(0));
  static_cast<void>(subscriptions.take("\1snap", 5));
  EXPECT_TRUE(subscriptions.wanted(0));
  EXPECT_FALSE(subscriptions.wanted(1));
  static_cast<void>(subscriptions.take("\0snap"s, -1));  // ZeroMQ does not say who was last to want it
  EXPECT_FALSE(subscriptions.wanted(0));
}

TEST(Subscriptions, TellWhatIsNoSubscription) {
  Subscriptions subscriptions = with_two_topics();

  EXPECT_EQ(subscriptions.take("snapshot", 5), Verdict::NoSubscription);
  EXPECT_EQ(subscriptions.take("", 5), Verdict::NoSubscription);
  EXPECT_EQ(subscriptions.take("\1", 5), Verdict::Fine);  // everything
}

TEST(Subscriptions, KeepARealTopicThoughStrangersFilledTheRoom) {
  Subscriptions subscriptions = full();
  ASSERT_EQ(subscriptions.take("\1more junk", 100), Verdict::TooMany);

  EXPECT_EQ(subscriptions.take("\1snapshot\0"s, 101), Verdict::Fine);

  EXPECT_TRUE(subscriptions.wanted(0));
}

TEST(Subscriptions, DoNotBlameTheNextOwnerOfADescriptor) {
  Subscriptions subscriptions = with_two_topics();
  Verdict verdict = Verdict::Fine;
  for (int i = 0; i < 10000 && verdict == Verdict::Fine; ++i) verdict = subscriptions.take("\1health", 5);
  ASSERT_EQ(verdict, Verdict::TooMany);

  subscriptions.forget(5);

  EXPECT_EQ(subscriptions.take("\1snapshot", 5), Verdict::Fine);
}

}  // namespace
}  // namespace mocap::wire
