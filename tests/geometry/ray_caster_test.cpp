#include "geometry/ray_caster.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <ostream>
#include <random>
#include <vector>

#include "geometry/lens.h"
#include "support/marker_world.h"

namespace mocap::geometry {
namespace ray_caster_test {

CameraModel camera_of(LensKind kind, double strength) {
  CameraModel camera = test::camera_at({4.0, 0.0, 2.5});
  camera.lens.kind = kind;
  if (kind == LensKind::Fisheye) camera.lens.distortion << 0.05, -0.01, 0.004, -0.001, 0.0;
  camera.lens.distortion *= strength;
  return camera;
}

struct DistortedLens {
  LensKind kind;
  double strength;
};

std::ostream& operator<<(std::ostream& out, const DistortedLens& lens) {
  return out << (lens.kind == LensKind::Fisheye ? "fisheye " : "pinhole ") << lens.strength;
}

class RayCasterOf : public testing::TestWithParam<DistortedLens> {};

TEST_P(RayCasterOf, CorrectsDistortionInTheWholeImageAndGivesTheDerivative) {
  const CameraModel camera = camera_of(GetParam().kind, GetParam().strength);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(-5.0, camera.width_px + 4.0);  // includes pixels outside the image
  std::uniform_real_distribution<double> y(-5.0, camera.height_px + 4.0);
  for (int i = 0; i < 5000; ++i) {
    const PixelPoint pixel{{x(random), y(random)}};

    const auto ray = ray_of(camera.lens, pixel);

    ASSERT_TRUE(ray) << pixel.v.transpose();
    EXPECT_LT((distort(camera.lens, ray->point).v - pixel.v).norm(), 1e-6) << pixel.v.transpose();
    const Eigen::Vector2d step(1e-4, -2e-4);
    const Eigen::Vector2d moved = distort(camera.lens, {ray->point.v + step}).v - pixel.v;
    EXPECT_LT((ray->px_from_ray * step - moved).norm(), 1e-3 * moved.norm()) << pixel.v.transpose();
  }
}

TEST_P(RayCasterOf, CastsManyPixelsAsPreciselyAsEachAlone) {
  const CameraModel camera = camera_of(GetParam().kind, GetParam().strength);
  const RayCaster caster(camera);
  std::vector<double> u;
  std::vector<double> v;
  for (double y = -3.5; y < camera.height_px + 4.0; y += 20.25) {  // includes the border and pixels outside the image
    for (double x = -3.5; x < camera.width_px + 4.0; x += 20.25) {
      u.push_back(x);
      v.push_back(y);
    }
  }
  RayColumns rays(u.size());

  caster.cast(u, v, rays);

  for (std::size_t i = 0; i < u.size(); ++i) {
    ASSERT_EQ(rays.exists[i], 1) << u[i] << " " << v[i];
    EXPECT_LT((distort(camera.lens, rays[i].point).v - Eigen::Vector2d(u[i], v[i])).norm(), 1e-6)
        << u[i] << " " << v[i];
    const auto alone = ray_of(camera.lens, {{u[i], v[i]}});
    EXPECT_LT((rays[i].px_from_ray - alone->px_from_ray).norm(), 1e-4 * alone->px_from_ray.norm());
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, RayCasterOf,
                         testing::Values(DistortedLens{LensKind::Pinhole, 0.0}, DistortedLens{LensKind::Pinhole, 1.0},
                                         DistortedLens{LensKind::Pinhole, 1.6}, DistortedLens{LensKind::Fisheye, 1.0},
                                         DistortedLens{LensKind::Fisheye, 3.0}));

TEST(RayCaster, GivesNoRayWhereTheDistortionFoldsTheImage) {
  CameraModel camera;
  camera.width_px = 640;
  camera.height_px = 480;
  camera.lens.fx_px = camera.lens.fy_px = 500.0;
  camera.lens.cx_px = 320.0;
  camera.lens.cy_px = 240.0;
  camera.lens.distortion << -0.5, 0.0, 0.0, 0.0, 0.0;  // r (1 - r^2 / 2) never exceeds 0.544: 272 px
  const RayCaster caster(camera);

  EXPECT_FALSE(ray_of(camera.lens, {{320.0 + 300.0, 240.0}}));
  RayColumns rays(2);
  const std::array<double, 2> u{620.0, 570.0};
  const std::array<double, 2> v{240.0, 240.0};
  caster.cast(u, v, rays);
  EXPECT_EQ(rays.exists[0], 0);
  ASSERT_EQ(rays.exists[1], 1);
  EXPECT_LT((distort(camera.lens, rays[1].point).v - Eigen::Vector2d(570.0, 240.0)).norm(), 1e-6);
  ASSERT_TRUE(ray_of(camera.lens, {{320.0 + 250.0, 240.0}}));
  EXPECT_LT(
      (distort(camera.lens, ray_of(camera.lens, {{570.0, 240.0}})->point).v - Eigen::Vector2d(570.0, 240.0)).norm(),
      1e-6);
}

TEST(RayCaster, GivesNoRayForAPixelThatIsNotFinite) {
  const RayCaster caster(camera_of(LensKind::Pinhole, 1.0));

  EXPECT_FALSE(ray_of(camera_of(LensKind::Pinhole, 1.0).lens, {{std::numeric_limits<double>::quiet_NaN(), 3.0}}));
  RayColumns rays(2);
  const std::array<double, 2> u{std::numeric_limits<double>::quiet_NaN(), 1e300};
  const std::array<double, 2> v{3.0, -std::numeric_limits<double>::infinity()};
  caster.cast(u, v, rays);
  EXPECT_EQ(rays.exists[0] + rays.exists[1], 0);
}

}  // namespace ray_caster_test
}  // namespace mocap::geometry
