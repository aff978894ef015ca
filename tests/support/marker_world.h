#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <random>
#include <span>
#include <vector>

#include "geometry/lens.h"
#include "model/camera_model.h"
#include "model/sighting.h"

namespace mocap::test {

/// The transform of a camera at `eye` that looks at `target`, its y axis downwards.
inline CameraFromWorld look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target) {
  const Eigen::Vector3d forward = (target - eye).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  const Eigen::Vector3d down = forward.cross(right);
  CameraFromWorld camera_from_world;
  camera_from_world.rotation << right.transpose(), down.transpose(), forward.transpose();
  camera_from_world.translation = -camera_from_world.rotation * eye;
  return camera_from_world;
}

/// A 1280x1024 camera with lens distortion.
inline CameraModel camera_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target = {0.0, 0.0, 1.0}) {
  CameraModel camera;
  camera.width_px = 1280;
  camera.height_px = 1024;
  camera.lens.fx_px = 900.0;
  camera.lens.fy_px = 905.0;
  camera.lens.cx_px = 642.0;
  camera.lens.cy_px = 509.0;
  camera.lens.distortion << -0.18, 0.06, 0.0008, -0.0005, -0.004;
  camera.camera_from_world = look_at(eye, target);
  return camera;
}

/// `count` cameras on a ring of 4 m radius, 2.5 m high, that look at its middle.
inline Rig ring(std::size_t count) {
  Rig rig;
  for (std::size_t i = 0; i < count; ++i) {
    // Uneven spacing, so that no two cameras face each other exactly.
    const double angle = 2.0 * std::numbers::pi * (static_cast<double>(i) + 0.1 * static_cast<double>(i % 3)) /
                         static_cast<double>(count);
    rig.push_back(camera_at({4.0 * std::cos(angle), 4.0 * std::sin(angle), 2.5}));
  }
  return rig;
}

/// Returns markers uniformly distributed in a box of the size of a moving person.
inline std::vector<Eigen::Vector3d> cloud(std::size_t count, std::mt19937& random) {
  std::uniform_real_distribution<double> across(-0.8, 0.8);
  std::uniform_real_distribution<double> up(0.1, 1.9);
  std::vector<Eigen::Vector3d> markers;
  for (std::size_t i = 0; i < count; ++i) markers.emplace_back(across(random), across(random), up(random));
  return markers;
}

/// Returns 18 markers on the joints of a figure that walks along x, at `time_s`: four on the axis of the body, then
/// those of each side from neck to foot.
inline std::vector<Eigen::Vector3d> walker(double time_s) {
  const double swing = std::sin(2.0 * std::numbers::pi * time_s);
  const double x = -1.0 + 1.2 * time_s;
  std::vector<Eigen::Vector3d> markers{{x, 0.0, 1.72}, {x, 0.0, 1.5}, {x + 0.02, 0.0, 1.3}, {x, 0.0, 0.95}};
  for (const double side : {-1.0, 1.0}) {
    const double arm = 0.35 * side * swing;
    const double leg = -0.4 * side * swing;
    const auto add = [&](double along, double out, double height) {
      markers.emplace_back(x + along, out * side, height);
    };
    add(0.0, 0.08, 1.45);
    add(0.0, 0.2, 1.42);
    add(0.25 * std::sin(arm), 0.24, 1.42 - 0.28 * std::cos(arm));
    add(0.5 * std::sin(arm) + 0.03, 0.25, 1.42 - 0.52 * std::cos(arm));
    add(0.0, 0.1, 0.9);
    add(0.42 * std::sin(leg), 0.1, 0.9 - 0.42 * std::cos(leg));
    add(0.82 * std::sin(leg) - 0.05, 0.1, 0.94 - 0.82 * std::cos(leg));
  }
  return markers;
}

struct SeenAs {
  double sigma_px = 0.1;      ///< of each blob's centroid
  double missed = 0.0;        ///< fraction of the views of a marker without a blob
  double false_blobs = 0.0;   ///< per true blob
  double merge_below_px = 0;  ///< two blobs nearer than this become one
};

/// A frame set, and the true marker of each of its blobs.
struct SeenWorld {
  std::vector<std::unique_ptr<BlobFrame>> frames;
  /// Index of the marker, by view and blob; -1: none. A merged blob belongs to `marker_of` and `also_of`.
  std::vector<std::vector<int>> marker_of;
  std::vector<std::vector<int>> also_of;
  FrameSet set;

  /// Returns the number of views with an unmerged blob of the marker.
  int views_of(int marker) const {
    int views = 0;
    for (std::size_t v = 0; v < marker_of.size(); ++v) {
      for (std::size_t b = 0; b < marker_of[v].size(); ++b) {
        views += marker_of[v][b] == marker && also_of[v][b] < 0 ? 1 : 0;
      }
    }
    return views;
  }
};

inline void merge_near_blobs(BlobFrame& frame, std::vector<int>& marker_of, std::vector<int>& also_of,
                             double below_px) {
  for (std::size_t i = 0; i < frame.blobs.size(); ++i) {
    for (std::size_t j = i + 1; j < frame.blobs.size();) {
      if ((frame.blobs[i].centroid.v - frame.blobs[j].centroid.v).norm() >= below_px) {
        ++j;
        continue;
      }
      frame.blobs[i].centroid.v = 0.5 * (frame.blobs[i].centroid.v + frame.blobs[j].centroid.v);
      frame.blobs[i].merged = true;
      also_of[i] = marker_of[j];
      frame.blobs.erase_unordered(j);
      marker_of[j] = marker_of.back();
      marker_of.pop_back();
      also_of[j] = also_of.back();
      also_of.pop_back();
    }
  }
}

inline SeenWorld see(const Rig& rig, std::span<const Eigen::Vector3d> markers, const SeenAs& as, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, as.sigma_px);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  SeenWorld world;
  world.set.expected_views = static_cast<std::uint32_t>(rig.size());
  for (std::size_t c = 0; c < rig.size(); ++c) {
    auto& frame = *world.frames.emplace_back(std::make_unique<BlobFrame>());
    auto& marker_of = world.marker_of.emplace_back();
    frame.camera = CameraId{static_cast<std::uint32_t>(c)};
    const auto add = [&](const Eigen::Vector2d& at, int marker) {
      Blob blob;
      blob.centroid.v = at;
      blob.sigma_px = as.sigma_px;
      if (frame.blobs.try_push_back(blob)) marker_of.push_back(marker);
    };
    for (std::size_t m = 0; m < markers.size(); ++m) {
      const auto pixel = geometry::project(rig[c], {markers[m]});
      if (share(random) < as.missed || !pixel || !geometry::in_image(rig[c], *pixel)) continue;
      add(pixel->v + Eigen::Vector2d(noise(random), noise(random)), static_cast<int>(m));
    }
    const auto extra = static_cast<int>(as.false_blobs * static_cast<double>(markers.size()) + share(random));
    for (int i = 0; i < extra; ++i) add({share(random) * rig[c].width_px, share(random) * rig[c].height_px}, -1);
    auto& also_of = world.also_of.emplace_back(marker_of.size(), -1);
    merge_near_blobs(frame, marker_of, also_of, as.merge_below_px);
    world.set.views.push_back(&frame);
  }
  return world;
}

/// Returns predictions of the markers with Gaussian errors of `off_m` on each axis and the matching covariance.
inline Predictions expect(std::span<const Eigen::Vector3d> markers, double off_m, std::mt19937& random) {
  std::normal_distribution<double> noise(0.0, off_m);
  Predictions expected;
  for (std::size_t m = 0; m < markers.size(); ++m) {
    PredictedMarker marker;
    marker.position.v = markers[m] + Eigen::Vector3d(noise(random), noise(random), noise(random));
    marker.covariance_m2 = Eigen::Matrix3d::Identity() * off_m * off_m;
    marker.track = TrackId{static_cast<std::uint32_t>(m)};
    expected.markers.push_back(marker);
  }
  return expected;
}

}  // namespace mocap::test
