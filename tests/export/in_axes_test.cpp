#include "export/clip/in_axes.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/places.h"

namespace mocap::exports {
namespace in_axes_test {

using nlohmann::json;

constexpr double kSame = 1e-12;  // doubles that are permuted

Eigen::Vector3d position_of(const json& pose) {
  const json& at = pose.at("position");
  return {at[0].get<double>(), at[1].get<double>(), at[2].get<double>()};
}

Eigen::Quaterniond rotation_of(const json& pose) {
  const json& q = pose.at("rotation_xyzw");
  return {q[3].get<double>(), q[0].get<double>(), q[1].get<double>(), q[2].get<double>()};
}

// proto/axes has the same poses in the axes of the feed and of glTF.
TEST(InAxes, AgreesWithThePublishedPosesInGltfAxes) {
  int poses = 0;
  for (const auto& entry : std::filesystem::directory_iterator(support::source_folder() + "/proto/axes")) {
    if (entry.path().extension() != ".json") continue;
    const json example = json::parse(std::ifstream(entry.path()));
    const json &feed = example.at("mocap"), &gltf = example.at("gltf");
    ++poses;

    EXPECT_LT((in_axes(position_of(feed), Axes::YUp) - position_of(gltf)).norm(), kSame) << entry.path();
    EXPECT_LT((in_axes(rotation_of(feed), Axes::YUp).coeffs() - rotation_of(gltf).coeffs()).norm(), kSame)
        << entry.path();
    EXPECT_EQ(in_axes(position_of(feed), Axes::ZUp), position_of(feed));
  }
  EXPECT_GE(poses, 10);
}

}  // namespace in_axes_test
}  // namespace mocap::exports
