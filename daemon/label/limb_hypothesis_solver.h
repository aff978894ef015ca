#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "identify/distance_constraints.h"
#include "kinematics/observation.h"
#include "label/distance_constraint_matcher.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// Which of a few tracks bear the names of one limb, as it was at one instant: the likely readings by the distances
/// that the body keeps, each judged by the pose that it leads to.
///
/// First `clear`, the names, the places, what is allowed, `begin`; then `advance` until it is no longer busy. A reading
/// costs a pose or two, and there may be a hundred: what is found is then of some sets ago.
///
/// Allocates in the constructor only.
class LimbHypothesisSolver {
 public:
  static constexpr int kUnassigned = DistanceConstraintMatcher::kUnassigned;

  /// Where a marker of the limb may be.
  struct CandidateTrack {
    TrackId track;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double sigma_m = 0.0;
    bool is_young = false;  ///< rays may meet there by chance
  };

  LimbHypothesisSolver(const MarkerSet& set, const pose::SkeletonTrackerSettings& follow);

  void clear();
  /// False when there are too many already.
  bool add_label(std::size_t marker);
  bool add_candidate(const CandidateTrack& candidate);
  std::size_t label_count() const noexcept { return matcher_.label_count(); }
  std::size_t candidate_count() const noexcept { return candidates_.size(); }
  std::size_t marker(std::size_t label) const { return matcher_.marker(label); }
  const CandidateTrack& candidate(std::size_t candidate) const { return candidates_[candidate]; }

  /// A name may be at a place, against which its ties to the rest of the body say `cost`, half squared sigmas;
  /// `continuity`, 0 to 1: how much tells for it that the track bore the name before.
  void allow(std::size_t label, std::size_t candidate, double cost, double continuity);
  /// The name is there now, surely; only a clearly better reading may have it elsewhere.
  void set_current(std::size_t label, int candidate) {
    current_.candidate_of[label] = static_cast<std::int8_t>(candidate);
  }

  /// From here on the limb is read: of this body, which `others` tell beside the limb; the bones that followed wrong
  /// markers may be turned anyhow.
  void begin(const identify::DistanceConstraints& constraints, const pose::SkeletonTracker& body,
             std::span<const kinematics::Observation> others, std::span<const char> unreliable);
  bool busy() const noexcept { return stage_ != Stage::Done; }
  void stop() noexcept { stage_ = Stage::Done; }
  /// Judges `most` readings or fewer, and says how many. `constraints` are those of `begin`.
  int advance(const identify::DistanceConstraints& constraints, int most);

  /// Where a clearly better reading than that of now has the names; on which others that are about as good say
  /// otherwise, kUnassigned. Null where there is none.
  const DistanceConstraintMatcher::AssignmentHypothesis* found() const noexcept { return found_ ? &best_ : nullptr; }
  int current(std::size_t label) const { return current_.candidate_of[label]; }
  /// The best reading, clearly better or not.
  const DistanceConstraintMatcher::AssignmentHypothesis& likeliest() const noexcept { return likeliest_; }
  using Probabilities = std::array<double, DistanceConstraintMatcher::kMaxLimbLabels>;
  /// How likely it is of each name, by the readings that are about as good as the best, that a place is its own. All
  /// zero where one of these gives the place to none.
  Probabilities association_probabilities(int candidate) const;

 private:
  enum class Stage { Initial, SwapNeighbours, Alternatives, SameBoneAmbiguities, Done };

  bool propose_next(const identify::DistanceConstraints& constraints);
  bool add_hypothesis(const DistanceConstraintMatcher::AssignmentHypothesis& hypothesis);
  void add_hypothesis(std::span<const DistanceConstraintMatcher::AssignmentHypothesis> found);
  void swap_neighbours(const identify::DistanceConstraints& constraints);
  bool enumerate_next_alternatives(const identify::DistanceConstraints& constraints);
  void enumerate_alternatives(std::size_t label, const identify::DistanceConstraints& constraints);
  void evaluate(std::size_t hypothesis);
  bool reevaluate(std::size_t hypothesis);
  double gather_observations(const DistanceConstraintMatcher::AssignmentHypothesis& hypothesis);
  void find_same_bone_ambiguities(const DistanceConstraintMatcher::AssignmentHypothesis& hypothesis,
                                  const DistanceConstraintMatcher::AssignmentHypothesis& best);
  int bone_of(std::size_t label) const { return bone_of_[marker(label)]; }
  const DistanceConstraintMatcher::AssignmentHypothesis& best_evaluated() const;
  bool contests(const DistanceConstraintMatcher::AssignmentHypothesis& other,
                const DistanceConstraintMatcher::AssignmentHypothesis& best, std::size_t label) const;
  double margin(std::size_t label, std::size_t other_label) const;
  std::size_t label_at(const DistanceConstraintMatcher::AssignmentHypothesis& hypothesis, int candidate) const;
  void select_best();

  DistanceConstraintMatcher matcher_;
  std::vector<int> bone_of_;  // by marker
  std::vector<CandidateTrack> candidates_;
  std::array<std::array<double, DistanceConstraintMatcher::kMaxCandidates>, DistanceConstraintMatcher::kMaxLimbLabels>
      continuity_{};
  DistanceConstraintMatcher::AssignmentHypothesis current_;
  pose::SkeletonTracker body_;
  std::vector<kinematics::Observation> rest_observations_;
  std::vector<char> unreliable_;                                             // by bone
  std::vector<char> unconstrained_;                                          // by bone, of one reading
  std::vector<kinematics::Observation> trial_observations_;                  // markers as a reading has them
  std::vector<DistanceConstraintMatcher::AssignmentHypothesis> hypotheses_;  // the first is that of now
  std::size_t evaluated_count_ = 0;                                          // of these
  std::size_t swap_limit_ = 0;  // readings when no more are proposed by exchange
  Stage stage_ = Stage::Done;
  std::size_t next_label_ = 0;        // to be challenged
  std::size_t next_reevaluated_ = 0;  // reading to be judged anew
  std::vector<Pose> best_pose_;       // locals that the best reading led to
  std::vector<pose::SkeletonTracker::MarkerSwing>
      same_bone_ambiguities_;  // of one reading: the names that the best has for each other's
  DistanceConstraintMatcher::AssignmentHypothesis best_;  // when the present stage began; in the end, what is found
  DistanceConstraintMatcher::AssignmentHypothesis likeliest_;
  bool found_ = false;
};

}  // namespace mocap::label
