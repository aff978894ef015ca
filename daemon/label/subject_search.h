#pragma once

#include <Eigen/Core>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "identify/any_pose_finder.h"
#include "identify/calibration_pose.h"
#include "identify/rigid_finder.h"
#include "identify/tpose_finder.h"
#include "identify/uncalibrated_body_finder.h"
#include "kinematics/pose_fit.h"
#include "label/label_settings.h"
#include "label/labelled_tracks.h"
#include "label/stationary_tracks.h"
#include "model/sighting.h"
#include "model/skeleton.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// An identified subject: the track of each label, the pose, and the body model if it was fitted in the same step.
struct RecognisedSubject {
  BoundedVector<TrackId, kMaxLabels> track_of_marker;  ///< by label; an id that names nothing: no track, or ambiguous
  BoundedVector<Pose, kMaxBones> locals;               ///< local poses as in PoseFit; empty: unknown
  bool is_newly_fitted = false;                        ///< the fields below are valid
  bool in_any_pose = false;                            ///< fitted in another pose than T-pose and A-pose
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;
  double rms_m = 0.0;  ///< distance of the markers from the fitted body

  void archive(Archive& members) {
    members(track_of_marker, locals, is_newly_fitted, in_any_pose, rest_offsets_m, marker_offsets_m, rms_m);
  }
};

/// Searches for one subject among the tracks without a label. A body of one bone is found by its inter-marker
/// distances, a person with a fitted body in any pose, another person in T-pose or A-pose (the finders of `identify`),
/// and in any pose if LabelSettings::search_uncalibrated is set.
///
/// A search in any pose takes several sets and works on the tracks of the set in which it began. Its result must then
/// fit the moving tracks for some time (verification); tracks that do not move with the body are removed as clutter.
/// Allocates in the constructor only. One thread.
class SubjectSearch {
 public:
  SubjectSearch(const LabelSettings& settings, const Subject& subject);

  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }
  /// Whether the body was fitted, so that it can be found in any pose.
  bool has_fitted_body() const noexcept { return fitted_ && any_pose_.can_find(); }

  /// Replaces bone lengths and marker offsets, and marks the body as fitted.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);
  /// Takes the hinge axes and swivel planes that the tracker learned.
  void learn_joints(const pose::SkeletonTracker& body);
  /// Takes over the body of the same subject and the search in progress; the settings stay. `before` is not used
  /// afterwards.
  void adopt(SubjectSearch& before);
  /// Marks the body as not fitted: the next calibration pose fits it.
  void forget_body();
  /// Whether a search or a verification continues in the next set.
  bool busy() const noexcept { return any_pose_.searching() || verified_since_.has_value(); }
  /// Aborts search and verification.
  void stop();

  /// Works for one set. `is_only_person`: no other person is missing, so that a body of unknown dimensions can only be
  /// this one. Returns the subject when it is found and verified, else null. The result is borrowed until the next
  /// call.
  const RecognisedSubject* step(const LabelledTracks& tracks, const StationaryTracks& stationary, bool is_only_person,
                                Timestamp at);

  /// Negative log likelihood of this body on the tracks of another subject: half the sum of squared residuals over
  /// sigma^2. Nothing if the marker sets differ in size, this body is not fitted, or the other one was just fitted.
  std::optional<double> residual_cost(const RecognisedSubject& other, const LabelledTracks& tracks);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  void gather_measured(const LabelledTracks& tracks);
  void gather_stationary(const LabelledTracks& tracks, const StationaryTracks& stationary);
  void gather_for_any_pose(const LabelledTracks& tracks);
  template <typename PointOf>
  void gather(const LabelledTracks& tracks, PointOf point_of);
  void select_cluster(std::size_t most);
  const RecognisedSubject* begin_search(const LabelledTracks& tracks, const StationaryTracks& stationary, Timestamp at);
  const RecognisedSubject* search_calibration_pose();
  void search_uncalibrated(const LabelledTracks& tracks, std::size_t work, Timestamp at);
  const RecognisedSubject* accept_calibration_pose(const identify::FoundBody& found);
  void set_tracks(std::span<const int> point_of_marker, std::span<const TrackId> track_of_point);
  void begin_verification(const identify::FoundPose& found, std::span<const TrackId> track_of_point, Timestamp at);
  void begin_verification(const identify::FoundUncalibratedBody& found, Timestamp at);
  bool is_unobserved(const LabelledTracks& tracks) const;
  const RecognisedSubject* verify(const LabelledTracks& tracks, Timestamp at);
  std::size_t work_until(Timestamp at);
  double fit(const LabelledTracks& tracks, const RecognisedSubject& recognised, int iterations);

  LabelSettings settings_;
  MarkerSet set_;
  bool fitted_;
  identify::TPoseFinder tpose_finder_;
  std::optional<identify::CalibrationPose> calibration_pose_;  // A-pose; none for a body without arms
  std::optional<identify::TPoseFinder> apose_finder_;
  bool search_apose_next_ = false;
  identify::RigidFinder rigid_finder_;
  identify::AnyPoseFinder any_pose_;
  std::optional<identify::UncalibratedBodyFinder> uncalibrated_;  // if wanted
  std::vector<TrackId> uncalibrated_tracks_;                      // of its points
  kinematics::PoseFit pose_fit_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<TrackId> track_of_point_;
  std::vector<std::pair<double, std::size_t>> nearest_;  // squared distance to the chosen point, point
  std::minstd_rand random_{1};                           // chooses that point; fixed seed
  std::vector<kinematics::Observation> observations_;
  std::optional<Timestamp> searched_at_;     // last search for a calibration pose
  std::optional<Timestamp> not_found_at_;    // first failure in any pose
  std::optional<Timestamp> stepped_at_;      // last set
  std::optional<Timestamp> verified_since_;  // the set in which the body was found
  double max_residual_m_ = 0.0;
  RecognisedSubject found_;
};

}  // namespace mocap::label
