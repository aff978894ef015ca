#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "geometry/assignment.h"
#include "identify/distance_constraints.h"
#include "label/label_settings.h"
#include "label/labelled_tracks.h"
#include "label/limb_hypothesis_solver.h"
#include "label/subject_search.h"
#include "model/sighting.h"
#include "model/skeleton.h"
#include "model/subject_state.h"
#include "module/ambiguous_observation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// The labels of one subject, from frame set to frame set.
///
/// The labeller predicts the body pose, compares every track with the predicted position of every marker, and assigns
/// tracks to labels by position, by the distances that the body keeps, and by track continuity. A label therefore
/// follows the body and not the track: a track that jumps loses its label, and so do two tracks that exchange their
/// markers, within five sets (`label_swaps_test`). Where labels are missing and unassigned tracks are near, a limb (a
/// subtree of bones) is labelled as a whole by `LimbHypothesisSolver`.
///
/// Order of calls in a set, made by `BodyLabeller` and `TrackAssociation`: `match_tracks`; while tracking: `predict`,
/// `fit`, `build_costs`, `release_unassigned`, `assign`, `revise`, `check_loss`. Without a body: `recognise`.
///
/// The source files are: subject_labeller.cpp (tracks, prediction, life cycle), association_costs.cpp (costs of
/// single assignments, rejection of labels), limb_selection.cpp (which limb, which candidates), reassociate_limb.cpp
/// (application of a limb hypothesis, ambiguous observations) and labeller_archive.cpp (the belief). mechanisms.md
/// explains each mechanism and the evidence for it; one tracker with a single probabilistic model is to replace them.
///
/// Costs here are negative log likelihoods times two ("squared sigmas", chi-square units); costs in
/// `LimbHypothesisSolver` are half of that. Positions are in world coordinates, m. One thread; allocates in the
/// constructor only. The `tracks` argument of all methods is the same object within one set.
class SubjectLabeller {
 public:
  SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id);

  /// Removes all labels. The phase becomes Searching.
  void forget();
  /// Takes over body, pose and labels of the same subject; settings and id stay. `before` is not used afterwards.
  void adopt(SubjectLabeller& before);
  bool tracking() const noexcept { return phase_ == SubjectPhase::Tracking; }
  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }
  std::size_t label_count() const noexcept { return memories_.size(); }

  /// Finds the track of each label in this set, and releases the labels whose track ended or was not detected for more
  /// than two sets.
  void match_tracks(LabelledTracks& tracks, Timestamp at);
  /// Predicts the body pose at `at`, and accepts the labels whose track is near the predicted position of the marker.
  void predict(const LabelledTracks& tracks, Timestamp at);
  /// World positions, m, of the track of an accepted label and of the marker as the body predicts it.
  struct MarkerResidual {
    Eigen::Vector3d at, predicted;
  };
  /// Nothing for a label that is not accepted.
  std::optional<MarkerResidual> marker_residual(std::size_t marker, const LabelledTracks& tracks) const;
  /// Withdraws the acceptance of a label that may have exchanged its track with another label.
  void distrust(std::size_t marker);
  /// Fits the body pose to the accepted labels, and marks their tracks as trusted.
  void fit(LabelledTracks& tracks);
  /// Appends the allowed pairs of label (row, from `first_row` on) and track (column) with their costs, until `pairs`
  /// has `max_pairs` elements. Appends nothing if all labels are accepted or no unassigned track is visible.
  void build_costs(const LabelledTracks& tracks, std::size_t first_row, std::size_t max_pairs,
                   std::vector<geometry::AllowedPair>& pairs);
  /// Whether this subject takes part in the assignment of this set: the last `build_costs` had unassigned tracks.
  bool participates() const noexcept { return participates_; }
  /// Releases the labels to which the assignment gave another track or none. `columns` has the assigned column of each
  /// label. A coasting track without another assignment keeps its label.
  void release_unassigned(std::span<const std::uint32_t> columns, LabelledTracks& tracks);
  /// Whether the track had this label before the assignment.
  bool is_assigned_to(std::size_t marker, std::uint32_t track) const {
    return previous_tracks_[marker] == static_cast<int>(track);
  }
  /// Whether the track of the label was not where its own velocity led to.
  bool discontinuous(std::size_t marker) const { return discontinuous_[marker]; }
  void release_label(std::size_t marker, LabelledTracks& tracks) { release(marker, tracks); }
  /// Whether a track is inside the gate of an assignment (4 sigma and `most_gate_m`). A track outside may only compete
  /// with other assignments.
  bool inside_gate(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const;
  /// Whether a missing label that has a distance constraint to `marker` would have the track at a cost below `below`.
  bool may_be_neighbour(std::size_t marker, std::uint32_t track, double below, const LabelledTracks& tracks) const;
  /// Whether the last limb hypotheses left the track ambiguous among markers other than `marker` alone.
  bool is_ambiguous(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const;
  /// Gives the track the label, with the confidence of a new label.
  void assign(std::size_t marker, std::uint32_t track, LabelledTracks& tracks);
  /// Removes labels that contradict the fitted pose, labels limbs as a whole, and commits the pose of this set.
  void revise(LabelledTracks& tracks);
  /// Whether too few labels for a pose were measured for so long that the predicted pose cannot tell the markers apart.
  /// To be asked before the labels of a set, also after a gap between sets. `step`: the time between the two sets
  /// before.
  bool is_out_of_sight(Timestamp at, Duration step) const;
  /// Ends the tracking, phase Lost.
  void lose();
  /// Ends the tracking, phase Lost, after `lost_after` with too few labels or with too many unexplained tracks.
  void check_loss(LabelledTracks& tracks, Timestamp at);
  /// Adopts the labels of an identified subject and begins to track. Returns false, without tracking, if the labelled
  /// tracks determine no pose.
  bool recognise(const RecognisedSubject& found, LabelledTracks& tracks, Timestamp at);

  /// The body pose by which labels are judged; the published pose is the solver's.
  const pose::SkeletonTracker& body() const noexcept { return body_; }
  /// Writes the labels of this set. A label on a coasting track, or one that is not accepted, is Filled.
  void write_labels(const LabelledTracks& tracks, SubjectLabels& into) const;
  /// Appends the tracks that the last hypotheses of a limb left ambiguous, for at most 0.05 s.
  void append_ambiguous_observations(const LabelledTracks& tracks, AmbiguousObservations& into) const;
  /// Returns, once, the body model that `recognise` adopted.
  std::optional<SubjectFit> take_fit();
  /// Replaces bone lengths and marker offsets. Requires as many as the marker set has.
  void refit(const SubjectFit& fit);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  // Standard deviation of a marker that took part in the pose fit from the position that the fit gives it. Chosen by
  // hand; not yet measured.
  static constexpr double kFittedMarkerSigma_m = 0.008;
  // Confidence of a new label. Chosen by hand; not yet measured.
  static constexpr float kNewLabelConfidence = 0.6F;
  // Confidence of an established label, reached from 0.6 after ten accepted sets (0.1 of the way to 1 in each set).
  // Chosen by hand; not yet measured.
  static constexpr float kEstablishedConfidence = 0.85F;
  // Rejection hysteresis: a label is released after so many sets with a residual above the gate, or after one set with
  // twice the gate. Chosen by hand; not yet measured.
  static constexpr int kMaxRejectCount = 3;
  // Sets until a limb that was not labelled is tried again. Chosen by hand; not yet measured.
  static constexpr int kCooldownSets = 2;

  // Marginal association probability of an ambiguous track.
  struct Marginal {
    std::uint16_t marker;
    float probability;

    void archive(Archive& members) { members(marker, probability); }
  };
  struct LabelMemory {
    TrackId track;
    int index = LabelledTracks::kNone;  // of the track in this set
    int reject_count = 0;               // sets in which the fitted pose contradicted the label, minus agreeing sets
    float confidence = 0.0F;
    double usual_residual_m = 0.003;  // running mean of the distance to the position by the fitted pose
    bool established = false;         // the confidence reached kEstablishedConfidence on this track
    TrackId last_track;               // had the label until the label was released
    bool was_discontinuous = false;   // last_track was discontinuous, at its release or since
    bool is_continuous = false;       // last_track was detected in every set since its release
    bool discontinuous = false;       // the track is not where its own velocity led to
    TrackId ambiguous_track;          // most likely this marker, but may be another one of the marginals
    BoundedVector<Marginal, DistanceConstraintMatcher::kMaxLimbLabels> marginals;  // association probabilities of it
    Timestamp ambiguous_at;
    Timestamp seen_at;  // time of position and velocity, which are of the track, or of last_track
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();

    void archive(Archive& members);
  };
  // Predicted position of a marker and its covariance. `known` is false if the pose does not determine the position.
  struct PredictedPlace {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
    bool known = false;
  };

  void release(std::size_t marker, LabelledTracks& tracks);
  void assign_track(std::size_t marker, int index, float confidence, LabelledTracks& tracks);
  bool is_measured(std::size_t marker, const LabelledTracks& tracks) const;
  double continuity_of(std::size_t marker, int index, const LabelledTracks& tracks) const;
  bool is_unassigned_track(std::size_t track, const LabelledTracks& tracks) const;
  bool satisfies_distances(std::size_t marker, const Eigen::Vector3d& at, const LabelledTracks& tracks) const;
  kinematics::Observation observe(std::size_t marker, const LabelledTracks& tracks) const;
  static double sigma_of(int index, const LabelledTracks& tracks);
  static Eigen::Matrix3d isotropic_covariance(double sigma_m) {
    return sigma_m * sigma_m * Eigen::Matrix3d::Identity();
  }
  void check_continuity(LabelMemory& memory, const TrackedMarker& track, Timestamp at) const;
  void check_last_track(LabelMemory& memory, const LabelledTracks& tracks, Timestamp at) const;
  void establish(std::size_t marker);
  bool is_last_track_of(std::size_t other, TrackId track) const;
  bool is_last_track_of_neighbour(std::size_t marker, TrackId track) const;
  bool is_contested(std::size_t marker) const;
  void select_consistent(const LabelledTracks& tracks, Timestamp at);
  void predict_places();
  Eigen::Matrix3d innovation_covariance(std::size_t marker, const TrackedMarker& track) const;
  // Mahalanobis distance from which on a track has no cost for a label, and so does not compete for it. Chosen by hand;
  // not yet measured. Above the gate of an assignment, so that a near miss still makes an assignment ambiguous.
  static constexpr double kCompetingSigmas = 5.0;
  void assignment_cost(std::size_t marker, std::size_t index, const LabelledTracks& tracks, geometry::AllowedPair& into,
                       double max_sigmas = kCompetingSigmas) const;
  double residual_gate(std::size_t marker) const;
  bool supported_by_rigid_neighbours(std::size_t marker, double off_m, const LabelledTracks& tracks) const;
  void reject_contradicted(LabelledTracks& tracks);
  void learn(const RecognisedSubject& found);
  void set_offsets(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  bool follows_wrong_tracks() const;
  void reassociate_limbs(LabelledTracks& tracks);
  void count_unexplained(LabelledTracks& tracks);
  int worst_bone() const;
  bool begin_hypotheses(const LabelledTracks& tracks);
  bool gather_limb(std::size_t seed, const LabelledTracks& tracks);
  bool has_no_trusted_label(std::size_t bone) const;
  double reach_m(std::size_t marker) const;
  bool add_bone(std::size_t bone);
  void add_candidates(const LabelledTracks& tracks);
  bool is_clutter_candidate(int index, const LabelledTracks& tracks) const;
  void allow_candidates(const LabelledTracks& tracks);
  double distance_cost(std::size_t marker, const Eigen::Vector3d& at, const LabelledTracks& tracks) const;
  bool map_hypothesis(const DistanceConstraintMatcher::AssignmentHypothesis& found, const LabelledTracks& tracks);
  double competing_cost(std::size_t marker, int index, const LabelledTracks& tracks) const;
  bool has_competing_label(int index, double below, const LabelledTracks& tracks) const;
  bool is_ambiguous_elsewhere(TrackId track) const;
  bool is_assigned_elsewhere(int track) const;
  bool has_other_subject(int track, const LabelledTracks& tracks) const;
  void apply_hypothesis(LabelledTracks& tracks);
  void compute_marginals(const LabelledTracks& tracks);
  bool has_valid_memories() const;
  bool has_current_marginal(const LabelMemory& memory) const;

  LabelSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  identify::DistanceConstraints constraints_;
  pose::SkeletonTracker body_;
  SubjectPhase phase_ = SubjectPhase::Searching;
  std::uint32_t identifications_ = 0;
  Timestamp at_;
  Timestamp determined_at_;  // last set with enough measured labels to determine a pose
  Timestamp enough_at_;      // last set with enough labels
  Timestamp plausible_at_;   // last set in which the body did not follow wrong tracks
  std::vector<LabelMemory> memories_;
  std::vector<PredictedPlace> places_;
  std::vector<kinematics::Observation> observations_;  // of the accepted labels in this set
  std::vector<bool> accepted_;                         // by marker: has an element in observations_
  std::vector<bool> discontinuous_;                    // by marker: the track before the assignment was discontinuous
  std::vector<bool> motion_consistent_;                // by marker: accepted by `predict`, and still on the same track
  std::vector<int> previous_tracks_;                   // by marker: index of the track before the assignment
  bool participates_ = false;
  double usual_residual_m_ = 0.003;  // running mean of the distance of accepted markers to the fitted pose

  LimbHypothesisSolver limb_;
  std::array<TrackId, DistanceConstraintMatcher::kMaxLimbLabels>
      initial_tracks_;  // by label of the limb: its track when the search began
  std::array<int, DistanceConstraintMatcher::kMaxLimbLabels> hypothesis_track_{};  // by label of the limb: as found
  std::vector<int> unassigned_tracks_;  // detected tracks without an accepted label
  std::vector<int> unexplained_;        // by bone: missing labels that have an unassigned track near
  std::vector<int> cooldown_;           // by bone: sets until its limb may be labelled again
  std::vector<bool> in_limb_;           // by bone
  std::vector<char> unreliable_;        // by bone: labels were rejected, so the pose may have followed wrong tracks
  std::vector<char> unconstrained_;  // by bone: scratch; bones without a prior for one hypothesis, and the limb so far
  std::vector<std::pair<double, int>> nearby_tracks_;        // squared distance to the limb, unassigned track
  std::vector<kinematics::Observation> trial_observations_;  // of accepted labels outside the limb
  std::optional<SubjectFit> fit_;
};

}  // namespace mocap::label
