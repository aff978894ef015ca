#include "cameras/driver_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::cameras {

// A make of this test alone.
struct PinholeSettings {
  static constexpr MakeName kMake{"pinhole", "a box with a hole", "box"};
  int port = 5600;
};

void declare_keys(KeyVisitor& keys, PinholeSettings& camera) { keys.number("port", camera.port, {1, 65535}); }

std::vector<KeyFault> faults_of(const PinholeSettings& camera) {
  if (camera.port == 80) return {{"port", "port is that of a web server"}};
  return {};
}

CameraFacts facts_of(const PinholeSettings& camera, const std::string& camera_name) {
  return {.rate_hz = 100.0, .device = {{"port", camera_name + std::to_string(camera.port)}}};
}

struct OtherSettings {
  static constexpr MakeName kMake{"other", "another make", "other"};
};
void declare_keys(KeyVisitor& /*keys*/, OtherSettings& /*camera*/) {}
std::vector<KeyFault> faults_of(const OtherSettings& /*camera*/) { return {}; }
CameraFacts facts_of(const OtherSettings& /*camera*/, const std::string& /*camera_name*/) { return {}; }

namespace driver_settings_test {

TEST(DriverSettings, HoldTheSettingsOfAnyMake) {
  const DriverSettings settings = PinholeSettings{.port = 7};

  ASSERT_NE(settings.as<PinholeSettings>(), nullptr);
  EXPECT_EQ(settings.as<PinholeSettings>()->port, 7);
  EXPECT_EQ(settings.as<OtherSettings>(), nullptr);
  EXPECT_EQ(settings.driver(), "pinhole");
}

TEST(DriverSettings, OfNoMakeHaveNoFaultsAndNoFacts) {
  const DriverSettings none;

  EXPECT_EQ(none.driver(), "");
  EXPECT_EQ(none.as<PinholeSettings>(), nullptr);
  EXPECT_TRUE(none.all_faults().empty());
  EXPECT_EQ(none.facts("west").rate_hz, std::nullopt);
}

TEST(DriverSettings, AreValues) {
  const DriverSettings original = PinholeSettings{.port = 7};
  DriverSettings copy = original;

  copy.as<PinholeSettings>()->port = 8;

  EXPECT_EQ(original.as<PinholeSettings>()->port, 7);
  copy = original;
  EXPECT_EQ(copy.as<PinholeSettings>()->port, 7);
}

TEST(DriverSettings, StateTheFactsOfTheirMake) {
  const CameraFacts facts = DriverSettings(PinholeSettings{}).facts("west");

  EXPECT_EQ(facts.rate_hz, 100.0);
  ASSERT_EQ(facts.device.size(), 1U);
  EXPECT_EQ(facts.device[0].second, "west5600");
}

TEST(DriverSettings, DistinguishValuesOutOfRangeFromBrokenRules) {
  const DriverSettings out_of_range = PinholeSettings{.port = 0};
  const DriverSettings broken = PinholeSettings{.port = 80};

  EXPECT_TRUE(out_of_range.faults().empty());
  ASSERT_EQ(out_of_range.all_faults().size(), 1U);
  EXPECT_EQ(out_of_range.all_faults()[0].message, "port is 0, expected 1 to 65535");
  ASSERT_EQ(broken.faults().size(), 1U);
  EXPECT_EQ(broken.faults()[0].message, "port is that of a web server");
}

}  // namespace driver_settings_test
}  // namespace mocap::cameras
