#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/wand/wand_recording.h"
#include "geometry/lens.h"
#include "model/camera_model.h"
#include "scene/random.h"

namespace mocap::test {

/// Appends an image of each camera: 80 % of the points in view with noise of 0.1 px, and two false blobs.
inline void see_points(const Rig& rig, std::span<const Eigen::Vector3d> points, double t_s, scene::Random& random,
                       calibration::Take& take) {
  take.cameras.resize(rig.size());
  for (std::size_t c = 0; c < rig.size(); ++c) {
    calibration::Picture& picture = take.cameras[c].emplace_back();
    picture.exposed_at = from_ns(0) + from_s(t_s);
    for (const Eigen::Vector3d& point : points) {
      const auto at = geometry::project(rig[c], {point});
      if (!at || !geometry::in_image(rig[c], *at) || random.uniform() < 0.2) continue;
      picture.spots.push_back({{at->v + 0.1 * Eigen::Vector2d(random.normal(), random.normal())}, 0.1});
    }
    for (int i = 0; i < 2; ++i)
      picture.spots.push_back({{{rig[c].width_px * random.uniform(), rig[c].height_px * random.uniform()}}, 0.1});
  }
}

/// Twenty markers that move through the volume, about 1 m/s.
inline calibration::Take moving_markers(const Rig& rig, std::uint64_t seed, double seconds = 10.0,
                                        double rate_hz = 60.0) {
  scene::Random random(seed);
  calibration::Take take;
  for (double t = 0.0; t < seconds; t += 1.0 / rate_hz) {
    std::vector<Eigen::Vector3d> points;
    for (int m = 0; m < 20; ++m) {
      const double phase = 1.7 * m;
      points.emplace_back(1.2 * std::sin(0.5 * t + phase), 1.2 * std::cos(0.37 * t + 2.3 * phase),
                          1.0 + 0.7 * std::sin(0.61 * t + 0.9 * phase));
    }
    see_points(rig, points, t, random, take);
  }
  return take;
}

}  // namespace mocap::test
