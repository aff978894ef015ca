#pragma once

#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "base/bounded_vector.h"
#include "identify/any_pose_finder.h"
#include "identify/calibration_pose.h"
#include "identify/rigid_finder.h"
#include "identify/tpose_finder.h"
#include "kinematics/pose_fit.h"
#include "label/label_settings.h"
#include "label/labelled_tracks.h"
#include "label/stationary_tracks.h"
#include "model/sighting.h"
#include "model/skeleton.h"
#include "pose/skeleton_tracker.h"

namespace mocap::label {

/// A subject that was found: who bears its names, in which pose, and its measures where they were fitted now.
struct RecognisedSubject {
  BoundedVector<TrackId, kMaxLabels> track_of_marker;  ///< names nothing: no track, or not sure which
  BoundedVector<Pose, kMaxBones> locals;               ///< as PoseFit has them; empty: not told
  bool is_newly_fitted = false;                        ///< then the rest is told
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;
  double rms_m = 0.0;  ///< of the markers from the body
};

/// Looks for one subject among the tracks that nobody bears. A thing of one bone is found by its distances, a person
/// whose measures are known in any pose, others in T-pose or A-pose.
///
/// A search for a pose is spread over sets: it looks at one instant while the tracks go on. What it finds must then
/// hold for some sets while the body moves; a track that does not go with it was a ghost. Allocates in the constructor
/// only.
class SubjectSearch {
 public:
  SubjectSearch(const LabelSettings& settings, const Subject& subject);

  bool rigid() const noexcept { return set_.skeleton.bones.size() == 1; }
  /// Whether it may be found in any pose.
  bool has_fitted_body() const noexcept { return fitted_ && any_.can_find(); }

  /// From now on this is its body.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);
  /// How its joints bend, as was learnt while it was followed.
  void learn_joints(const pose::SkeletonTracker& body);
  /// Its measures are as little known as at the start: the next T-pose tells them.
  void forget_body();
  /// Whether it is in the midst of something that takes more sets.
  bool busy() const noexcept { return any_.searching() || sets_to_verify_ > 0; }
  /// Gives up what it is at; the next call begins anew.
  void stop();

  /// One set's share of the work. What was found is borrowed until the next call.
  const RecognisedSubject* step(const LabelledTracks& tracks, const StationaryTracks& stationary, Timestamp at);

  /// What this body costs on what another of the same marker set was recognised by: half the sum of squares over
  /// sigma. Nothing where the sets differ or this body is not known.
  std::optional<double> residual_cost(const RecognisedSubject& other, const LabelledTracks& tracks);

 private:
  void gather(const LabelledTracks& tracks, const StationaryTracks& stationary, Duration still_for);
  void select_cluster(std::size_t most);
  const RecognisedSubject* search_calibration_pose();
  const RecognisedSubject* accept_calibration_pose(const identify::FoundBody& found);
  void begin_verification();
  const RecognisedSubject* verify(const LabelledTracks& tracks);
  double fit(const LabelledTracks& tracks, const RecognisedSubject& recognised, int iterations);

  LabelSettings settings_;
  MarkerSet set_;
  bool fitted_;
  identify::TPoseFinder tpose_;
  std::optional<identify::CalibrationPose> stance_;  // A-pose, of bodies that can
  std::optional<identify::TPoseFinder> apose_;
  bool search_apose_next_ = false;  // the next time
  identify::RigidFinder shape_;
  identify::AnyPoseFinder any_;
  kinematics::PoseFit pose_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<TrackId> track_of_point_;
  std::vector<std::pair<double, std::size_t>> nearest_;  // points by how far they are from one, squared
  std::minstd_rand random_{1};                           // which one it is
  std::vector<kinematics::Observation> observations_;
  std::optional<Timestamp> searched_at_;   // for a standing body
  std::optional<Timestamp> not_found_at_;  // in any pose, first
  int sets_to_verify_ = 0;
  double max_residual_m_ = 0.0;
  RecognisedSubject found_;
};

}  // namespace mocap::label
