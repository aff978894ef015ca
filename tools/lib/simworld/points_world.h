#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "lib/simworld/points_motion.h"
#include "lib/simworld/points_visibility.h"
#include "model/blob.h"
#include "model/camera_model.h"
#include "scene/random.h"

namespace mocap::simworld {

/// Settings of the simulated cameras.
struct WorldSettings {
  int cameras = 8;
  double rate_hz = 100.0;
  double noise_px = 0.1;     ///< standard deviation of a blob centroid, each axis; equal to the blob's sigma_px
  double misses = 0.0;       ///< probability that a view of a marker gives no blob
  double false_blobs = 0.0;  ///< expected number for each blob of a marker, anywhere in the image
  double lost_frames = 0.0;  ///< probability that an image is lost
  double jitter_us = 0.0;    ///< largest deviation of a time stamp from the instant, in both directions
  double marker_diameter_m = 0.014;
  bool merge = false;  ///< join blobs that touch
  Visibility visibility = Visibility::Perfect;
};

/// One instant: the true lights and the blobs of the cameras.
struct SeenInstant {
  Timestamp exposed_at;
  std::vector<Light> lights;
  std::vector<std::uint64_t> alone_in;  ///< by light: bit mask of the cameras in which the light has a blob of its own
  std::vector<std::uint64_t>
      merged_in;  ///< by light: bit mask of the cameras in which the light is part of a merged blob
  std::vector<std::optional<BlobFrame>> frames;  ///< by camera; empty: the image was lost
  /// By camera, then by blob: the lights of the blob; empty for a false blob.
  std::vector<std::vector<std::vector<std::uint32_t>>> lights_in;
};

/// A simulated rig around a motion: cameras of 1280x1024 px with lens distortion on a slightly uneven ring that is wide
/// enough for the motion. The same seed gives the same world.
class PointsWorld {
 public:
  /// `motion` must outlive the PointsWorld.
  PointsWorld(const WorldSettings& settings, const PointMotion& motion, std::uint64_t seed);

  const Rig& rig() const { return rig_; }

  /// Simulates the next instant, one period after the previous one. Valid until the next call.
  const SeenInstant& next();

 private:
  struct Spot {
    Eigen::Vector2d centre_px;
    double radius_px = 0.0;
    std::uint32_t light = 0;
  };

  void see(std::uint32_t camera, BlobFrame& frame);
  void give_blobs(std::uint32_t camera, BlobFrame& frame);
  void add_false_blobs(const CameraModel& camera, BlobFrame& frame);
  Eigen::Vector2d noise();

  WorldSettings settings_;
  const PointMotion& motion_;
  scene::Random random_;
  Rig rig_;
  VisibilityModel visibility_;
  std::uint64_t number_ = 0;
  SeenInstant now_;
  std::vector<Spot> spots_;
  std::vector<std::uint32_t> group_of_;
};

}  // namespace mocap::simworld
