#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "calibration/wand/wand.h"
#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"
#include "scene/random.h"

namespace mocap::simworld {

/// Settings of a simulated wand recording.
struct WandWorldSettings {
  int cameras = 8;
  double noise_px = 0.1;  ///< standard deviation of a blob centroid, each axis; equal to the reported sigma
  double seconds = 60.0;
  double rate_hz = 60.0;
  double false_blobs = 0.01;  ///< expected number for each true blob, anywhere in the image
  bool body = true;           ///< the body of the person with the wand hides some views
  bool fisheye = false;       ///< fisheye lenses of 126 degrees; otherwise pinhole lenses of 63 degrees
};

/// A wand that moves through the volume at up to about 2 m/s in all orientations, seen by cameras of 1280x1024 px on a
/// slightly uneven ring of 4 m radius and 2.5 m height. The lenses have distortion and a decentred principal point. The
/// same seed gives the same world.
class WandWorld {
 public:
  WandWorld(const WandWorldSettings& settings, const calibration::Wand& wand, std::uint64_t seed);

  const Rig& truth() const { return truth_; }
  calibration::Take take();
  /// Initial lenses for a calibration without lens files: focal lengths with a random error of up to `share`, no
  /// distortion, the principal point in the centre of the image, and no poses.
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
