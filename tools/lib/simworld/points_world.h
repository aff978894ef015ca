#pragma once

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

/// How the simulated cameras see.
struct WorldSettings {
  int cameras = 8;
  double rate_hz = 100.0;
  double noise_px = 0.1;     ///< standard deviation of a blob's centroid, each axis; told truthfully
  double misses = 0.0;       ///< share of a marker's views that give no blob
  double false_blobs = 0.0;  ///< per blob of a marker, anywhere in the image
  double lost_frames = 0.0;  ///< share of images that never come
  double jitter_us = 0.0;    ///< the time stamps of one instant differ by so much, either way
  double marker_diameter_m = 0.014;
  bool merge = false;  ///< blobs that touch become one
  Visibility visibility = Visibility::Perfect;
};

/// One instant: what is true, and what the cameras saw of it.
struct SeenInstant {
  Timestamp exposed_at;
  std::vector<Light> lights;
  std::vector<std::uint64_t> alone_in;           ///< by light: the cameras that have a blob of it alone, a bit each
  std::vector<std::uint64_t> merged_in;          ///< by light: the cameras in which it shares a blob
  std::vector<std::optional<BlobFrame>> frames;  ///< by camera; nothing: lost
  /// By camera, then by blob: the lights in it; none: a false blob.
  std::vector<std::vector<std::vector<std::uint32_t>>> lights_in;
};

/// A simulated rig around a motion. The same seed gives the same world. Cameras stand on a ring that is wide enough
/// for the motion, not quite evenly; 1280x1024, lenses bent.
class PointsWorld {
 public:
  /// `motion` outlives it.
  PointsWorld(const WorldSettings& settings, const PointMotion& motion, std::uint64_t seed);

  const Rig& rig() const { return rig_; }

  /// The next instant, one period after the last.
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
