#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "lib/scoring/frames.h"

namespace mocap::scoring {

/// How far off a subject's bones were, over the sets in which it had a pose; what the truth does not know is left out.
struct SkeletonCounts {
  std::uint64_t sets = 0;    ///< with a pose
  std::uint64_t joints = 0;  ///< judged
  double squares_m2 = 0.0;
  double max_m = 0.0;
  double rotation_squares_rad2 = 0.0;  ///< of bones in the world
  std::uint64_t untold = 0;            ///< joints among these whose bones no marker tells the whole turn of
  double untold_squares_rad2 = 0.0;    ///< likewise
  std::uint64_t hidden_joints = 0;     ///< of bones that the truth calls Filled: no own marker is visible
  double hidden_squares_m2 = 0.0;
  std::uint64_t jitters = 0;
  double jitter_squares_m2 = 0.0;  ///< of the second difference of a joint's error over three sets that follow

  std::optional<double> joint_rms_mm() const;
  std::optional<double> rotation_rms_deg() const;  ///< of all bones
  /// Of the bones whose turn the markers tell, and of those where they leave one open.
  std::optional<double> rotation_told_deg() const;
  std::optional<double> rotation_untold_deg() const;
  std::optional<double> hidden_joint_rms_mm() const;
  /// Standard deviation, in each axis, of the white noise that would give such second differences (they have six times
  /// its variance).
  std::optional<double> jitter_mm() const;

  void add(const SkeletonCounts& other);
};

/// How far off one bone was.
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

/// Judges the bones of a stream, set by set.
class SkeletonScorer {
 public:
  /// `told`: by subject and bone, whether its markers tell its turn; what is left out is told.
  explicit SkeletonScorer(bool keeps_errors = false, std::vector<std::vector<bool>> told = {})
      : keeps_errors_(keeps_errors), told_(std::move(told)) {}

  void add(const EvalFrame& truth, const EvalFrame& said);

  const std::map<std::uint32_t, SkeletonCounts>& counts() const { return counts_; }
  /// By subject, then by bone.
  const std::map<std::uint32_t, std::map<std::uint32_t, BoneCounts>>& bones() const { return bones_; }
  const std::map<std::uint32_t, std::vector<JointErrors>>& errors() const { return errors_; }

 private:
  struct Past {
    std::uint64_t set = 0;  // of the newest
    int known = 0;
    Eigen::Vector3d last = Eigen::Vector3d::Zero(), before = Eigen::Vector3d::Zero();
  };

  void judge(const PosedBone& said, const PosedBone& own, SkeletonCounts& counts);

  bool tells(const PosedBone& bone) const;

  bool keeps_errors_;
  std::vector<std::vector<bool>> told_;
  std::uint64_t set_ = 0;
  std::optional<Timestamp> begun_at_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, Past> past_;
  std::map<std::uint32_t, SkeletonCounts> counts_;
  std::map<std::uint32_t, std::map<std::uint32_t, BoneCounts>> bones_;
  std::map<std::uint32_t, std::vector<JointErrors>> errors_;
};

}  // namespace mocap::scoring
