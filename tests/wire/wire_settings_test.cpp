#include "wire/wire_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::wire {
namespace wire_settings_test {

TEST(WireSettings, HaveDefaultsWithinTheirRangesAndRules) {
  EXPECT_TRUE(check_keys(PublisherSettings{}).empty());
  EXPECT_TRUE(check_keys(ControlSettings{}).empty());
  EXPECT_TRUE(check_keys(CurveSettings{}).empty());
  EXPECT_TRUE(faults_of(PublisherSettings{}).empty());
  EXPECT_TRUE(faults_of(ControlSettings{}).empty());
  EXPECT_TRUE(faults_of(CurveSettings{}).empty());
}

TEST(PublisherSettings, PermitRemoteEndpointsOnlyWithAllowRemoteOrKeys) {
  PublisherSettings feed;
  feed.more_endpoints = {"tcp://0.0.0.0:5570"};

  const std::vector<KeyFault> faults = faults_of(feed);
  feed.allow_remote = true;
  const std::vector<KeyFault> allowed = faults_of(feed);
  feed.allow_remote = false;
  feed.curve = {.server_key = "server.key", .allowed = "clients"};
  const std::vector<KeyFault> authenticated = faults_of(feed);

  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].key, "more_endpoints");
  EXPECT_TRUE(allowed.empty());
  EXPECT_TRUE(authenticated.empty());
}

TEST(ControlSettings, NeedNoEndpointIfOffOrDerivedFromTheFeed) {
  ControlSettings control;
  for (const char* endpoint : {"", "none"}) {
    control.endpoint = endpoint;
    EXPECT_TRUE(faults_of(control).empty()) << endpoint;
  }
  control.endpoint = "somewhere";
  EXPECT_EQ(faults_of(control).size(), 1U);
}

TEST(CurveSettings, NeedBothFilesOrNeither) {
  EXPECT_EQ(faults_of(CurveSettings{.server_key = "server.key", .allowed = {}}).at(0).key, "server_key");
  EXPECT_EQ(faults_of(CurveSettings{.server_key = {}, .allowed = "clients"}).at(0).key, "allowed_keys");
  EXPECT_TRUE(faults_of(CurveSettings{.server_key = "server.key", .allowed = "clients"}).empty());
}

}  // namespace wire_settings_test
}  // namespace mocap::wire
