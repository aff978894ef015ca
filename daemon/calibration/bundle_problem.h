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

/// A bundle as the solver's parameter blocks: by camera a turn and place (6) and a lens (9), by place of the wand its
/// middle and direction (6, of which 5 are free). Only for this room.
class BundleProblem {
 public:
  static constexpr int kPose = 6;
  static constexpr int kLens = 9;
  static constexpr int kPlace = 6;
  static constexpr int kFreePlace = 5;

  BundleProblem(const Bundle& bundle, const BundleSettings& settings);
  ~BundleProblem();
  BundleProblem(const BundleProblem&) = delete;
  BundleProblem& operator=(const BundleProblem&) = delete;

  ceres::Problem& get() { return *problem_; }
  std::shared_ptr<ceres::OrderedGroups<double*>> places_first();
  void write_back(Bundle& bundle) const;

  double* pose(std::size_t camera) { return poses_[camera].data(); }
  double* lens(std::size_t camera) { return lenses_[camera].data(); }
  double* place(std::size_t place) { return places_[place].data(); }
  bool camera_used(std::size_t camera) const { return camera_used_[camera]; }
  bool place_used(std::size_t place) const { return place_used_[place]; }

 private:
  void free_lenses(const Bundle& bundle, LensFreedom freedom);

  std::vector<std::array<double, kPose>> poses_;
  std::vector<std::array<double, kLens>> lenses_;
  std::vector<std::array<double, kPlace>> places_;
  std::vector<bool> camera_used_;
  std::vector<bool> place_used_;
  std::unique_ptr<ceres::Problem> problem_;
};

/// How many numbers of a camera's lens are free.
std::vector<int> free_lens_parts(LensFreedom freedom, LensKind kind);

}  // namespace mocap::calibration
