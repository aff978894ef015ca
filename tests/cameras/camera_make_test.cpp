#include "cameras/camera_make.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "cameras/aravis/aravis_describe.h"
#include "cameras/own_network.h"
#include "cameras/served_gige.h"

namespace mocap::cameras {
namespace camera_make_test {

using testing::AllOf;
using testing::AnyOf;
using testing::Contains;
using testing::IsSupersetOf;
using testing::Not;
using testing::Pair;

// The keys that identify a device of this make in a [[camera]].
std::set<std::string> device_keys_of(const CameraMake& make) {
  std::set<std::string> keys;
  for (const auto& [key, value] : make.defaults().facts("north").device) keys.insert(key);
  return keys;
}

std::vector<std::string> names_of(const KeyPairs& properties) {
  std::vector<std::string> names;
  for (const auto& [name, value] : properties) names.push_back(name);
  return names;
}

// Discovery on loopback, where a served GigE Vision camera answers: without it, most machines have no camera to list.
class CameraDiscovery : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string refusal = enter_own_network(3);
    if (!refusal.empty()) GTEST_SKIP() << refusal;
  }
};

TEST_F(CameraDiscovery, ListsTheConnectedCamerasOfEveryMakeThatHasOne) {
  ServedGigE served("127.0.0.2", "M1");
  ASSERT_TRUE(served.running());
  std::vector<std::string_view> not_discoverable;

  for (const CameraMake& make : camera_makes()) {
    SCOPED_TRACE(make.name.driver);
    if (make.discover == nullptr) {
      not_discoverable.push_back(make.name.driver);
      continue;
    }
    const std::vector<KeyPairs> found = make.discover();

    // An operator copies one of the properties into a [[camera]] of this make.
    const std::set<std::string> device_keys = device_keys_of(make);
    for (const KeyPairs& camera : found) {
      const std::vector<std::string> names = names_of(camera);
      EXPECT_TRUE(std::ranges::any_of(
          camera, [&](const auto& each) { return device_keys.contains(each.first) && !each.second.empty(); }));
      EXPECT_EQ(names, names_of(found.front()));
      EXPECT_EQ(std::set<std::string>(names.begin(), names.end()).size(), names.size());
      EXPECT_FALSE(std::ranges::count(names, "driver"));  // the key of the make itself in the JSON list
    }
  }

  EXPECT_THAT(not_discoverable, IsSupersetOf({"replay", "synthetic", "tcp"}));
  EXPECT_THAT(not_discoverable, Not(AnyOf(Contains("aravis"), Contains("v4l2"))));
}

TEST_F(CameraDiscovery, ListsAGigeVisionCameraWithItsSerialNumberAndAddress) {
  ServedGigE served("127.0.0.2", "M2");
  ASSERT_TRUE(served.running());

  const std::vector<KeyPairs> found = find_make("aravis")->discover();

  EXPECT_THAT(found, Contains(AllOf(Contains(Pair("serial", "M2")), Contains(Pair("address", "127.0.0.2")),
                                    Contains(Pair("bus", "GigEVision")))));
}

TEST(CameraMakeTable, HasTheFunctionsOfADescriptionTogether) {
  for (const CameraMake& make : camera_makes()) {
    EXPECT_EQ(make.describe != nullptr, make.identified_by != nullptr) << make.name.driver;
    if (make.identified_by == nullptr) continue;
    EXPECT_EQ(make.identified_by("DA1").driver(), make.name.driver);
  }
}

TEST(CameraMakeTable, DistinguishesAddressMacAndSerialNumberOfAnAravisCamera) {
  EXPECT_EQ(aravis_settings_for("10.0.0.2").address, "10.0.0.2");
  EXPECT_EQ(aravis_settings_for("00:11:1c:f5:a0:01").mac, "00:11:1c:f5:a0:01");
  EXPECT_EQ(aravis_settings_for("DA1234567").serial, "DA1234567");
  for (const char* word : {"10.0.0.2", "00:11:1c:f5:a0:01", "DA1234567"}) {
    EXPECT_TRUE(faults_of(aravis_settings_for(word)).empty()) << word;
  }
}

}  // namespace camera_make_test
}  // namespace mocap::cameras
