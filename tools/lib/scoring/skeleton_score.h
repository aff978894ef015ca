#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "lib/scoring/frames.h"

namespace mocap::scoring {

/// Errors of one subject's bones, summed over the sets in which the subject had a pose. Bones that the truth lacks are
/// left out.
struct SkeletonCounts {
  std::uint64_t sets = 0;    ///< sets with a pose
  std::uint64_t joints = 0;  ///< scored joints
  double squares_m2 = 0.0;
  double max_m = 0.0;
  double rotation_squares_rad2 = 0.0;      ///< of the world rotations of the bones
  std::uint64_t unobservable = 0;          ///< scored joints whose bone rotation is not fully observable
  double unobservable_squares_rad2 = 0.0;  ///< rotation errors of these bones
  std::uint64_t hidden_joints =
      0;  ///< joints of bones that are Filled in the truth: none of the bone's markers is visible
  double hidden_squares_m2 = 0.0;
  std::uint64_t jitters = 0;
  double jitter_squares_m2 = 0.0;  ///< of the second difference of a joint's error over three consecutive sets

  std::optional<double> joint_rms_mm() const;
  std::optional<double> rotation_rms_deg() const;  ///< of all bones
  /// The rotation error of the bones whose rotation is fully observable, and of the other bones.
  std::optional<double> rotation_observable_deg() const;
  std::optional<double> rotation_unobservable_deg() const;
  std::optional<double> hidden_joint_rms_mm() const;
  /// Standard deviation in each axis of the white noise that produces these second differences. A second difference of
  /// white noise has six times the variance of the noise.
  std::optional<double> jitter_mm() const;

  void add(const SkeletonCounts& other);
};

/// Errors of one bone.
struct BoneCounts {
  std::uint64_t sets = 0;
  double squares_m2 = 0.0;
  double rotation_squares_rad2 = 0.0;

  std::optional<double> joint_rms_mm() const;
  std::optional<double> rotation_rms_deg() const;
};

/// The joint error of one set, for the plot.
struct JointErrors {
  double t_s = 0.0;
  double rms_mm = 0.0;
  double max_mm = 0.0;
};

/// Scores the bones of a stream, set by set.
class SkeletonScorer {
 public:
  /// `observable`: by subject and bone, whether the markers determine the full rotation of the bone. Bones beyond the
  /// end of a list count as observable.
  explicit SkeletonScorer(bool keeps_errors = false, std::vector<std::vector<bool>> observable = {})
      : keeps_errors_(keeps_errors), observable_(std::move(observable)) {}

  /// Adds one set. Sets must be added in the order of their exposure.
  void add(const EvalFrame& truth, const EvalFrame& reported);

  const std::map<std::uint32_t, SkeletonCounts>& counts() const { return counts_; }
  /// Indexed by subject, then by bone.
  const std::map<std::uint32_t, std::map<std::uint32_t, BoneCounts>>& bones() const { return bones_; }
  const std::map<std::uint32_t, std::vector<JointErrors>>& errors() const { return errors_; }

 private:
  struct Past {
    std::uint64_t set = 0;  // number of the newest set
    int known = 0;          // consecutive sets with an error, at most 2
    Eigen::Vector3d last = Eigen::Vector3d::Zero(), before = Eigen::Vector3d::Zero();
  };

  void judge(const PosedBone& reported, const PosedBone& own, SkeletonCounts& counts);

  bool is_observable(const PosedBone& bone) const;

  bool keeps_errors_;
  std::vector<std::vector<bool>> observable_;
  std::uint64_t set_ = 0;
  std::optional<Timestamp> begun_at_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Past> past_;
  std::map<std::uint32_t, SkeletonCounts> counts_;
  std::map<std::uint32_t, std::map<std::uint32_t, BoneCounts>> bones_;
  std::map<std::uint32_t, std::vector<JointErrors>> errors_;
};

}  // namespace mocap::scoring
