#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "model/image_mask.h"
#include "model/transform.h"

namespace mocap {

enum class LensKind {
  Pinhole,  ///< OpenCV's k1 k2 p1 p2 k3
  Fisheye,  ///< OpenCV's fisheye (equidistant) k1 k2 k3 k4
};

/// Intrinsics: the projection from rays to pixels.
struct Lens {
  LensKind kind = LensKind::Pinhole;
  double fx_px = 1.0;
  double fy_px = 1.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  /// Pinhole: k1 k2 p1 p2 k3. Fisheye: k1 k2 k3 k4 and 0.
  Eigen::Matrix<double, 5, 1> distortion = Eigen::Matrix<double, 5, 1>::Zero();
  /// Estimated with a wand, beginning with a field of view: the lens was never calibrated by itself.
  bool is_from_fov = false;
};

/// One calibrated camera.
struct CameraModel {
  std::string name;
  int width_px = 0;
  int height_px = 0;
  Lens lens;
  CameraFromWorld camera_from_world;
  std::vector<MaskPolygon> masks = {};         ///< masked parts of the image, drawn by a person
  std::vector<MaskPolygon> learnt_masks = {};  ///< masked parts that mocap-calibrate learned from an empty volume

  WorldPoint centre() const { return camera_from_world.inverse() * CameraPoint{}; }
};

/// The table of a rig file with facts about the rig. No camera has this name, because its table would be the same.
inline constexpr const char* kRigMetadata = "metadata";

/// The calibrated cameras, by CameraId.
using Rig = std::vector<CameraModel>;

}  // namespace mocap
