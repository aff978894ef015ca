#pragma once

#include <cstdint>

#include "calibration/wand/wand.h"
#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"
#include "scene/random.h"

namespace mocap::simworld {

/// A simulated take of a wand.
struct WandWorldSettings {
  int cameras = 8;
  double noise_px = 0.1;  ///< standard deviation of a blob's centroid, each axis; told truthfully
  double seconds = 60.0;
  double rate_hz = 60.0;
  double false_blobs = 0.01;  ///< for each true one, anywhere in the image
  bool body = true;           ///< whoever waves the wand stands in the way of some views
  bool fisheye = false;       ///< 126 degrees wide; else pinhole lenses, 63 degrees
};

/// Cameras on a ring of 4 m radius, 2.5 m high, not quite evenly, 1280x1024, lenses bent and not quite centred; a wand
/// led through the volume at up to about 2 m/s, turned every way. The same seed gives the same world.
class WandWorld {
 public:
  WandWorld(const WandWorldSettings& settings, const calibration::Wand& wand, std::uint64_t seed);

  const Rig& truth() const { return truth_; }
  calibration::Take take();
  /// What one knows who has no lens files: focal lengths wrong by up to `share` either way, no distortion, the optical
  /// centre in the middle of the image.
  Rig rough_lenses(double share);

 private:
  struct Wave {
    Eigen::Vector3d hz;
    Eigen::Vector3d phase;
  };

  Eigen::Vector3d wave(const Wave& wave, double t) const;
  bool hidden(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const Eigen::Vector3d& body) const;
  void see(const CameraModel& camera, std::span<const Eigen::Vector3d> marks, const Eigen::Vector3d& body,
           calibration::Picture& picture);
  Eigen::Vector2d noise();

  WandWorldSettings settings_;
  calibration::Wand wand_;
  scene::Random random_;
  Rig truth_;
  Wave slow_;
  Wave quick_;
  Wave turning_;
};

}  // namespace mocap::simworld
