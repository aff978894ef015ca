#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

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

/// One subject's names. The parts of the labeller call it in the order: keep; expect, claim, release_unassigned and
/// take, settle, judge; or recognise.
///
/// Names follow the body, not the tracks: where the body goes on to tells which track is which marker, all at once, and
/// that a track bore a name before is one more hint. So a track that jumps, or two that exchange their markers, lose
/// their names in the same set, and a marker that comes back has its name as soon as it is clear which it is. Where
/// names are missing while nameless tracks stand near, the whole limb is read anew; so is one that has a name on a
/// track that bore a neighbour's, until that name is there again or the new one was held for long.
class SubjectLabeller {
 public:
  SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id);

  /// Nobody is known to be anywhere.
  void forget();
  bool tracking() const noexcept { return phase_ == SubjectPhase::Tracking; }
  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }
  std::size_t label_count() const noexcept { return memories_.size(); }

  /// Finds the tracks of this set that bear the names.
  void match_tracks(LabelledTracks& tracks, Timestamp at);
  /// Moves the body on to `at`, with the names that are where its motion leads to.
  void predict(const LabelledTracks& tracks, Timestamp at);
  /// Where a believed name's track is, and where the body's motion puts it.
  struct MarkerResidual {
    Eigen::Vector3d at, predicted;
  };
  std::optional<MarkerResidual> marker_residual(std::size_t marker, const LabelledTracks& tracks) const;
  /// A name that may have exchanged its track with another.
  void distrust(std::size_t marker);
  /// Fits the body to the names that are believed.
  void fit(LabelledTracks& tracks);
  /// Appends what each name may be given to, rows from `first_row`; nothing where all names are as they should be.
  void build_costs(const LabelledTracks& tracks, std::size_t first_row, std::size_t most,
                   std::vector<geometry::AllowedPair>& pairs);
  bool participates() const noexcept { return participates_; }
  /// What the claims leave without its track is free again; `columns` by name.
  void release_unassigned(std::span<const std::uint32_t> columns, LabelledTracks& tracks);
  bool is_assigned_to(std::size_t marker, std::uint32_t track) const {
    return previous_tracks_[marker] == static_cast<int>(track);
  }
  bool discontinuous(std::size_t marker) const { return discontinuous_[marker]; }
  void release_label(std::size_t marker, LabelledTracks& tracks) { release(marker, tracks); }
  /// Whether a track is within the gate of a claim; claims from farther away only contest others.
  bool inside_gate(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const;
  /// Whether another missing name, of the same bone or one next to it, would have the track for less than `below`.
  bool may_be_neighbour(std::size_t marker, std::uint32_t track, double below, const LabelledTracks& tracks) const;
  /// Whether the last reading of its limb said that the track is, or may be, another marker.
  bool is_ambiguous(std::size_t marker, std::uint32_t track, const LabelledTracks& tracks) const;
  void assign(std::size_t marker, std::uint32_t track, LabelledTracks& tracks);
  /// Takes names back that the body contradicts, reads limbs anew, and learns.
  void revise(LabelledTracks& tracks);
  /// Decides whether enough is left to go on.
  void check_loss(LabelledTracks& tracks, Timestamp at);
  /// Takes the names as they were found. False, and nobody tracked, when that tells no pose.
  bool recognise(const RecognisedSubject& found, LabelledTracks& tracks, Timestamp at);

  const pose::SkeletonTracker& body() const noexcept { return body_; }
  void write_labels(const LabelledTracks& tracks, SubjectLabels& into) const;
  /// Appends what a limb's last reading left open, until it is read again.
  void append_ambiguous_observations(const LabelledTracks& tracks, std::vector<AmbiguousObservation>& into) const;
  std::optional<SubjectFit> take_fit();
  /// The body's bones and markers are known better.
  void refit(const SubjectFit& fit);

 private:
  static constexpr double kMarkerSigma_m = 0.004;
  static constexpr float kNewLabelConfidence = 0.6F;
  static constexpr int kCooldownSets = 2;  // sets until what did not come out is tried again

  struct Marginal {
    std::uint16_t marker;
    float probability;
  };
  struct LabelMemory {
    TrackId track;
    int index = LabelledTracks::kNone;  // in this instant's tracks
    int reject_count = 0;               // grows while the body contradicts
    float confidence = 0.0F;
    double usual_residual_m = 0.003;  // mean from its place
    bool established = false;         // by this track for about 20 sets
    TrackId last_track;               // bore it until it was lost or the name was taken back
    bool was_discontinuous = false;   // that track did, then or since
    bool is_continuous = false;       // it was seen on and on since
    bool discontinuous = false;       // its track is not where its own motion led to
    TrackId ambiguous_track;          // is likely its own, and may as well be that of another of
    BoundedVector<Marginal, DistanceConstraintMatcher::kMaxLimbLabels> marginals;  // these markers
    Timestamp ambiguous_at;
    Timestamp seen_at;  // the rest is of then
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  };
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
  void check_continuity(LabelMemory& memory, const TrackedMarker& track, Timestamp at) const;
  void check_last_track(LabelMemory& memory, const LabelledTracks& tracks, Timestamp at) const;
  void establish(std::size_t marker);
  bool is_missed_by(std::size_t other, TrackId track) const;
  bool is_missed_by_neighbour(std::size_t marker, TrackId track) const;
  bool is_contested(std::size_t marker) const;
  void select_consistent(const LabelledTracks& tracks, Timestamp at);
  void predict_places();
  Eigen::Matrix3d innovation_covariance(std::size_t marker, const TrackedMarker& track) const;
  // A track farther than that from where a marker is thought to be does not contest its name.
  static constexpr double kCompetingSigmas = 5.0;
  void assignment_cost(std::size_t marker, std::size_t index, const LabelledTracks& tracks, geometry::AllowedPair& into,
                       double most_sigmas = kCompetingSigmas) const;
  double residual_gate(std::size_t marker) const;
  bool supported_by_rigid_neighbours(std::size_t marker, double off_m, const LabelledTracks& tracks) const;
  void reject_contradicted(LabelledTracks& tracks);
  void learn(const RecognisedSubject& found);

  bool is_following_wrongly() const;
  void reassociate_limbs(LabelledTracks& tracks);
  void count_unexplained(LabelledTracks& tracks);
  int worst_bone() const;
  bool begin_hypotheses(const LabelledTracks& tracks);
  bool gather_limb(std::size_t seed, const LabelledTracks& tracks);
  bool has_no_trusted_label(std::size_t bone) const;
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
  void apply_hypothesis(LabelledTracks& tracks);
  void compute_marginals(const LabelledTracks& tracks);
  bool has_current_marginal(const LabelMemory& memory) const;

  LabelSettings settings_;
  SubjectId id_;
  MarkerSet set_;
  identify::DistanceConstraints constraints_;
  pose::SkeletonTracker body_;
  SubjectPhase phase_ = SubjectPhase::Searching;
  Timestamp at_;
  Timestamp enough_at_;
  Timestamp plausible_at_;  // when it was last not followed wrongly
  std::vector<LabelMemory> memories_;
  std::vector<PredictedPlace> places_;                 // where each marker should be
  std::vector<kinematics::Observation> observations_;  // names that are believed in this set
  std::vector<bool> accepted_;                         // by marker: is in observations_
  std::vector<bool> discontinuous_;                    // by marker: the track that it bore before did
  std::vector<bool> motion_consistent_;  // by marker: the body's motion led to the track that it bore before
  std::vector<int> previous_tracks_;     // the track of each name before an assignment
  bool participates_ = false;            // takes part in this set's assignment
  double usual_residual_m_ = 0.003;      // mean of the believed names from their places

  LimbHypothesisSolver limb_;
  std::array<TrackId, DistanceConstraintMatcher::kMaxLimbLabels>
      initial_tracks_;  // by the limb's names: their tracks when it was begun
  std::array<int, DistanceConstraintMatcher::kMaxLimbLabels> hypothesis_track_{};  // likewise: as the limb was read
  std::vector<int> unassigned_tracks_;                                             // tracks that no believed name bears
  std::vector<int> unexplained_;     // by bone: its names that are missing while strays stand near
  std::vector<int> cooldown_;        // by bone: sets until it is read anew again
  std::vector<bool> in_limb_;        // by bone
  std::vector<char> unreliable_;     // by bone: names were taken back, the pose may have followed wrong ones
  std::vector<char> unconstrained_;  // by bone, of one reading
  std::vector<std::pair<double, int>> nearby_tracks_;        // strays by how far they are from the limb, squared
  std::vector<kinematics::Observation> trial_observations_;  // names that are no part of the limb
  std::optional<SubjectFit> fit_;
};

}  // namespace mocap::label
