#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.h"
#include "identify/distance_constraints.h"
#include "kinematics/observation.h"
#include "label/distance_constraint_matcher.h"
#include "model/ids.h"
#include "model/skeleton.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// Labels one limb (a subtree of bones) as a whole, on the tracks of one set: enumerates the likely assignments by
/// inter-marker distances, and compares them by the cost of the body pose that each leads to. A multi-hypothesis
/// assignment in the sense of Reid (1979), in one set, with a pose fit as the likelihood of a hypothesis.
///
/// Order of calls: `clear`, `add_label`, `add_candidate`, `allow`, `set_current`, `begin`; then `advance`, over several
/// sets, until `busy` is false. A hypothesis costs one or two pose fits (0.2 to 0.6 ms, decision 0011), and there may
/// be a hundred: the result is then some sets old.
///
/// Stages: the current assignment and the six cheapest by distance (Initial); swaps of neighbours, from the best
/// (SwapNeighbours); alternatives to each new label of the best (Alternatives); refits of hypotheses that differ from
/// the best only in markers of one bone (SameBoneAmbiguities). A label is reported if every hypothesis that contradicts
/// it is worse by a margin.
///
/// Costs are negative log likelihoods (half chi-square). Allocates in the constructor only. One thread.
class LimbHypothesisSolver {
 public:
  static constexpr int kUnassigned = DistanceConstraintMatcher::kUnassigned;

  /// A track that may be a marker of the limb.
  struct CandidateTrack {
    TrackId track;
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double sigma_m = 0.0;
    bool is_young = false;  ///< tentative: may be clutter, rays that intersect by chance

    void archive(Archive& members) { members(track, at, sigma_m, is_young); }
  };

  LimbHypothesisSolver(const MarkerSet& set, const pose::SkeletonTrackerSettings& follow);

  void clear();
  /// Adds a label or a candidate. Returns false if there are too many already.
  bool add_label(std::size_t marker);
  bool add_candidate(const CandidateTrack& candidate);
  std::size_t label_count() const noexcept { return matcher_.label_count(); }
  std::size_t candidate_count() const noexcept { return candidates_.size(); }
  std::size_t marker(std::size_t label) const { return matcher_.marker(label); }
  const CandidateTrack& candidate(std::size_t candidate) const { return candidates_[candidate]; }

  /// Allows a candidate for a label. `cost`: of the distances to markers outside the limb. `continuity`, 0 to 1:
  /// evidence that the track is this marker because it had the label before.
  void allow(std::size_t label, std::size_t candidate, double cost, double continuity);
  /// The label is established on this candidate; only a clearly better hypothesis may change it.
  void set_current(std::size_t label, int candidate) {
    current_.candidate_of[label] = static_cast<std::int8_t>(candidate);
  }

  /// Starts a search on a copy of `body`. `others` are the observations of markers outside the limb. `unreliable`, by
  /// bone: the pose may have followed wrong tracks, and is no prior.
  void begin(const identify::DistanceConstraints& constraints, const pose::SkeletonTracker& body,
             std::span<const kinematics::Observation> others, std::span<const char> unreliable);
  bool busy() const noexcept { return stage_ != Stage::Done; }
  void stop() noexcept { stage_ = Stage::Done; }
  /// Evaluates at most `most` hypotheses and returns how many. `constraints` are those of `begin`. The result does not
  /// depend on how the work is divided into calls.
  int advance(const identify::DistanceConstraints& constraints, int most);

  /// The best hypothesis if it is clearly better than the current assignment, else null. Labels on which hypotheses
  /// about as good disagree are kUnassigned. Valid when not busy.
  const DistanceConstraintMatcher::AssignmentHypothesis* found() const noexcept { return found_ ? &best_ : nullptr; }
  /// Candidate of an established label; kUnassigned for other labels.
  int current(std::size_t label) const { return current_.candidate_of[label]; }
  /// The best hypothesis, whether clearly better or not, with all its labels.
  const DistanceConstraintMatcher::AssignmentHypothesis& likeliest() const noexcept { return likeliest_; }
  using Probabilities = std::array<double, DistanceConstraintMatcher::kMaxLimbLabels>;
  /// Association probabilities of a candidate, by label, over the hypotheses that are about as good as the best. All
  /// zero if one of these leaves the candidate unassigned.
  Probabilities association_probabilities(int candidate) const;

  /// Writes the search in progress, or takes it over (see Archive). The result of a search that ended is not a member.
  void archive(Archive& members);

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
  bool has_valid_indices() const;

  DistanceConstraintMatcher matcher_;
  std::vector<int> bone_of_;  // by marker
  std::vector<CandidateTrack> candidates_;
  std::array<std::array<double, DistanceConstraintMatcher::kMaxCandidates>, DistanceConstraintMatcher::kMaxLimbLabels>
      continuity_{};
  DistanceConstraintMatcher::AssignmentHypothesis current_;
  pose::SkeletonTracker body_;
  std::vector<kinematics::Observation> rest_observations_;
  std::vector<char> unreliable_;                                             // by bone
  std::vector<char> unconstrained_;                                          // by bone, of one hypothesis
  std::vector<kinematics::Observation> trial_observations_;                  // observations of one hypothesis
  std::vector<DistanceConstraintMatcher::AssignmentHypothesis> hypotheses_;  // the first is the current assignment
  std::size_t evaluated_count_ = 0;                                          // hypotheses with a cost
  std::size_t swap_limit_ = 0;  // size of hypotheses_ at which no more swaps are added
  Stage stage_ = Stage::Done;
  std::size_t next_label_ = 0;        // whose alternatives are enumerated next
  std::size_t next_reevaluated_ = 0;  // hypothesis that is evaluated again next
  std::vector<Pose> best_pose_;       // local poses of the best hypothesis
  std::vector<pose::SkeletonTracker::MarkerSwing>
      same_bone_ambiguities_;  // of one hypothesis: same-bone markers that differ from the best
  DistanceConstraintMatcher::AssignmentHypothesis best_;  // at the start of the stage; at the end, the result
  DistanceConstraintMatcher::AssignmentHypothesis likeliest_;
  bool found_ = false;
};

}  // namespace mocap::label
