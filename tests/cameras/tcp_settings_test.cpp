// Ranges and facts; tcp_camera_test.cpp has the rules for the address.
#include "cameras/tcp/tcp_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::cameras {
namespace tcp_settings_test {

TEST(TcpSettings, NameEveryValueOutsideItsRange) {
  TcpSettings settings;
  settings.port = 0;
  settings.width_px = 15;
  settings.height_px = 16385;
  settings.rate_hz = 0.0;

  std::vector<std::string> keys;
  for (const KeyFault& fault : check_keys(settings)) keys.push_back(fault.key);

  EXPECT_THAT(keys, testing::ElementsAre("port", "width_px", "height_px", "rate_hz"));
}

TEST(TcpSettings, RefuseAFormatThatTheProtocolDoesNotHave) {
  TcpSettings settings;
  EXPECT_TRUE(check_keys(settings).empty());

  settings.pixel_format = PixelFormat::Mono12p;

  ASSERT_EQ(check_keys(settings).size(), 1U);
  EXPECT_EQ(check_keys(settings)[0].key, "pixel_format");
}

TEST(TcpSettings, StateRateAndSizeOfTheImages) {
  TcpSettings settings;
  settings.width_px = 320;
  settings.height_px = 240;
  settings.rate_hz = 90.0;

  const CameraFacts facts = facts_of(settings, "north");

  EXPECT_EQ(facts.rate_hz, 90.0);
  ASSERT_TRUE(facts.size);
  EXPECT_EQ(facts.size->width_px, 320);
  EXPECT_EQ(facts.size->height_px, 240);
  EXPECT_FALSE(facts.recorded_time);
}

}  // namespace tcp_settings_test
}  // namespace mocap::cameras
