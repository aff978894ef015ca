#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>
#include <string>

#include "model/camera_model.h"

namespace mocap::support {

/// Returns six cameras of both lens kinds with random poses, one of them rotated by 180 degrees, and with names that
/// need quotes in TOML and YAML.
inline Rig random_rig(std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Rig rig;
  for (int i = 0; i < 6; ++i) {
    CameraModel camera;
    camera.name = i == 0 ? "north-east" : i == 1 ? "door: \"left\", #2" : "camera" + std::to_string(i);
    camera.width_px = 1280 + i;
    camera.height_px = 1024 - i;
    camera.lens.kind = i % 2 == 0 ? LensKind::Pinhole : LensKind::Fisheye;
    camera.lens.fx_px = 1000.0 + 300.0 * unit(random);
    camera.lens.fy_px = 1000.0 + 300.0 * unit(random);
    camera.lens.cx_px = 640.0 + 30.0 * unit(random);
    camera.lens.cy_px = 512.0 + 30.0 * unit(random);
    for (int k = 0; k < (i % 2 == 0 ? 5 : 4); ++k) camera.lens.distortion[k] = 0.3 * unit(random);
    const Eigen::Vector3d axis = Eigen::Vector3d(unit(random), unit(random), unit(random)).normalized();
    const double angle = i == 2 ? 3.14159265358979 : i == 3 ? 1e-9 : 3.0 * unit(random);
    camera.camera_from_world.rotation = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
    camera.camera_from_world.translation = 5.0 * Eigen::Vector3d(unit(random), unit(random), unit(random));
    rig.push_back(camera);
  }
  return rig;
}

/// Expects equal cameras: numbers to 1e-9 (m, px and without a unit).
inline void expect_same_rig(const Rig& found, const Rig& expected) {
  constexpr double kExact = 1e-9;
  ASSERT_EQ(found.size(), expected.size());
  for (std::size_t c = 0; c < found.size(); ++c) {
    SCOPED_TRACE(expected[c].name);
    EXPECT_EQ(found[c].name, expected[c].name);
    EXPECT_EQ(found[c].width_px, expected[c].width_px);
    EXPECT_EQ(found[c].height_px, expected[c].height_px);
    const Lens& a = found[c].lens;
    const Lens& b = expected[c].lens;
    EXPECT_EQ(a.kind, b.kind);
    EXPECT_NEAR(a.fx_px, b.fx_px, kExact);
    EXPECT_NEAR(a.fy_px, b.fy_px, kExact);
    EXPECT_NEAR(a.cx_px, b.cx_px, kExact);
    EXPECT_NEAR(a.cy_px, b.cy_px, kExact);
    EXPECT_LT((a.distortion - b.distortion).cwiseAbs().maxCoeff(), kExact);
    const auto& p = found[c].camera_from_world;
    const auto& q = expected[c].camera_from_world;
    EXPECT_LT((p.rotation - q.rotation).cwiseAbs().maxCoeff(), kExact);
    EXPECT_LT((p.translation - q.translation).cwiseAbs().maxCoeff(), kExact);
  }
}

}  // namespace mocap::support
