#include <gtest/gtest.h>

#include <string>

#include "web/feed/topics.h"
#include "web/http/shared.h"
#include "web/token_bucket.h"

namespace mocap::web {
namespace limits_test {

TEST(TokenBucket, PermitsABurstAndThenTheRate) {
  TokenBucket bucket(10.0, 3.0);
  const Timestamp start = from_ns(1'000'000'000);

  for (int i = 0; i < 3; ++i) EXPECT_TRUE(bucket.take(start));
  EXPECT_FALSE(bucket.take(start));
  EXPECT_FALSE(bucket.take(start + from_s(0.05)));
  EXPECT_TRUE(bucket.take(start + from_s(0.15)));
  EXPECT_FALSE(bucket.take(start + from_s(0.16)));
}

TEST(TokenBucket, SavesNoMoreThanABurst) {
  TokenBucket bucket(10.0, 2.0);
  bucket.take(from_ns(1'000'000'000));

  const Timestamp later = from_ns(1'000'000'000'000);

  EXPECT_TRUE(bucket.take(later));
  EXPECT_TRUE(bucket.take(later));
  EXPECT_FALSE(bucket.take(later));
}

TEST(Connections, KeepNoAddressThatWasRefused) {
  Connections connections;
  for (std::size_t i = 0; i < kMaxConnections; ++i) {
    ASSERT_TRUE(connections.add("10.0.0." + std::to_string(i % 2)));
  }

  for (int i = 0; i < 100; ++i) EXPECT_FALSE(connections.add("10.0.1." + std::to_string(i)));

  EXPECT_EQ(connections.addresses(), 2U);
}

TEST(Topics, AreThoseOfTheFeed) {
  for (const char* topic :
       {"description", "snapshot", "health", "event", "markers", "sightings", "preview/north", "subject/anna"}) {
    EXPECT_TRUE(is_topic(topic)) << topic;
  }
  for (const std::string& topic :
       {std::string(), std::string("preview/"), std::string("snapshots"), std::string("blobs/north"),
        std::string("preview/a\0b", 11), "preview/" + std::string(121, 'x')}) {
    EXPECT_FALSE(is_topic(topic)) << topic;
  }
}

}  // namespace limits_test
}  // namespace mocap::web
