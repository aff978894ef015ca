#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "calibration/wand/wand.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// Pose of the wand at one instant: the midpoint of its end markers and the unit vector from its first to its last
/// marker. A rotation about the wand's own axis does not move the markers and is not represented.
struct WandPose {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();
};

/// The image of one wand marker in one camera.
struct Observation {
  int camera = 0;     ///< index in the rig
  int wand_pose = 0;  ///< index in Bundle::wand_poses
  int marker = 0;     ///< index in Wand
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double sigma_px = 0.1;  ///< standard deviation per axis
  int instant = -1;       ///< index of the instant in the recording; -1: unknown
  int blob = -1;          ///< index of the blob in its image; -1: unknown
};

/// The intrinsic parameters that an adjustment estimates; the others stay constant.
enum class FreeIntrinsics {
  None,
  FocalLengths,       ///< fx fy
  FocalLengthsAndK1,  ///< fx fy k1
  All,                ///< fx fy, the principal point, all distortion coefficients
};

struct BundleSettings {
  FreeIntrinsics free_intrinsics = FreeIntrinsics::None;
  bool fix_first_camera = true;    ///< fixes the gauge: the pose of the first camera is constant
  bool fix_cameras = false;        ///< all cameras are constant: only the wand poses are estimated
  double loss_scale_sigmas = 3.0;  ///< scale of the Cauchy loss, in units of sigma_px; 0: squared loss
  int max_iterations = 50;
  double cost_tolerance = 1e-9;  ///< stops if the relative decrease of the cost is smaller
  int threads = 1;
};

/// The unknowns and the observations of a wand calibration.
struct Bundle {
  Rig rig;
  Wand wand;
  std::vector<WandPose> wand_poses;
  std::vector<Observation> observations;
  std::vector<bool> known_lenses = {};  ///< by camera: its intrinsics stay constant, whatever is free; empty: none do

  /// The intrinsics of a camera that an adjustment estimates if `wanted` are free.
  FreeIntrinsics free_intrinsics(std::size_t camera, FreeIntrinsics wanted) const {
    return camera < known_lenses.size() && known_lenses[camera] ? FreeIntrinsics::None : wanted;
  }
  WorldPoint marker_position(const WandPose& pose, int marker) const {
    return {pose.middle_m + (wand.marks_m[static_cast<std::size_t>(marker)] - wand.middle_m()) * pose.direction};
  }
  /// Reprojection residual, observed minus projected; nothing if the marker is not in front of the camera.
  std::optional<Eigen::Vector2d> residual_px(const Observation& observation) const;
};

/// Uncertainty of a camera's pose.
struct PoseUncertainty {
  double position_m = 0.0;    ///< standard deviation of the centre, root of the sum over three axes
  double rotation_rad = 0.0;  ///< the same of the rotation
};

/// Bundle adjustment: minimises the sum of squared reprojection residuals, each divided by its sigma_px, over camera
/// poses, free intrinsics and wand poses. The distances between the wand's markers are exact, so they fix the scale.
/// Returns false if Ceres finds no usable solution; `bundle` is then unchanged. `progress` gets the number of each
/// iteration; if it returns false, the adjustment ends with the solution of that iteration. Allocates.
///
/// Source: Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment - a modern synthesis" (2000).
bool adjust_bundle(Bundle& bundle, const BundleSettings& settings, const std::function<bool(int)>& progress = {});

/// Covariance of the camera poses of a rig.
struct RigCovariance {
  std::vector<PoseUncertainty> cameras;  ///< in the order of the rig
  /// Six rows a camera: centre (m), rotation (rad), in the rig's axes. The rank is six less than the number of rows.
  Eigen::MatrixXd covariance;
};

/// Covariance of a rig at the solution: the inverse of the normal matrix with the wand poses eliminated (Schur
/// complement), in the inner gauge in which the camera centres as a whole neither move nor rotate; nor do the cameras
/// about the line through the centres of two cameras. `variance`: the variance factor that scales the squared sigma_px
/// of the observations to their true values (chi squared over the degrees of freedom). Empty if the observations do not
/// determine the rig, or if a camera has none.
///
/// Source: Triggs et al. (2000), section 9 (gauge freedom).
RigCovariance rig_covariance(const Bundle& bundle, FreeIntrinsics free_intrinsics, double variance);

}  // namespace mocap::calibration
