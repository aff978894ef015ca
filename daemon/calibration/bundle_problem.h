#pragma once

#include <array>
#include <memory>
#include <vector>

#include "calibration/bundle.h"

namespace ceres {
class Problem;
template <typename T>
class OrderedGroups;
}  // namespace ceres

namespace mocap::calibration {

/// A Bundle as parameter blocks and residual blocks of Ceres. Used by adjust_bundle and rig_covariance only.
///
/// Blocks: a pose of 6 numbers for each camera (angle-axis, translation; camera from world), intrinsics of 9 numbers
/// for each camera, and 6 numbers for each wand pose (middle, unit direction: 5 degrees of freedom).
class BundleProblem {
 public:
  static constexpr int kPoseSize = 6;
  static constexpr int kIntrinsicsSize = 9;
  static constexpr int kWandPoseSize = 6;
  static constexpr int kWandPoseDof = 5;

  BundleProblem(const Bundle& bundle, const BundleSettings& settings);
  ~BundleProblem();
  BundleProblem(const BundleProblem&) = delete;
  BundleProblem& operator=(const BundleProblem&) = delete;

  ceres::Problem& get() { return *problem_; }
  /// The elimination order of the Schur complement: wand poses first, then cameras.
  std::shared_ptr<ceres::OrderedGroups<double*>> elimination_order();
  /// Copies the values of all parameter blocks into `bundle`.
  void write_back(Bundle& bundle) const;

  double* pose(std::size_t camera) { return poses_[camera].data(); }
  double* intrinsics(std::size_t camera) { return intrinsics_[camera].data(); }
  double* wand_pose(std::size_t index) { return wand_poses_[index].data(); }
  /// Whether any observation is of this camera, or of this wand pose.
  bool has_camera(std::size_t camera) const { return has_camera_[camera]; }
  bool has_wand_pose(std::size_t index) const { return has_wand_pose_[index]; }

 private:
  void set_free_intrinsics(const Bundle& bundle, FreeIntrinsics free_intrinsics);

  std::vector<std::array<double, kPoseSize>> poses_;
  std::vector<std::array<double, kIntrinsicsSize>> intrinsics_;
  std::vector<std::array<double, kWandPoseSize>> wand_poses_;
  std::vector<bool> has_camera_;
  std::vector<bool> has_wand_pose_;
  std::unique_ptr<ceres::Problem> problem_;
};

/// The indices of the free ones among the 9 intrinsic parameters.
std::vector<int> free_intrinsic_indices(FreeIntrinsics free_intrinsics, LensKind kind);

}  // namespace mocap::calibration
