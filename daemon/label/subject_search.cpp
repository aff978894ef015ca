#include "label/subject_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "kinematics/joint_prior.h"

namespace mocap::label {
namespace {

// Bounds the time of a search for a calibration pose. Chosen by hand; not yet measured.
constexpr std::size_t kMaxSearchPoints = 160;
// Time for which an identification must fit, and one set at least: a person at 1 m/s moves 3 cm meanwhile, and clutter
// does not.
constexpr Duration kVerificationTime = std::chrono::milliseconds(30);
// Gate of a marker in the verification, on the rms residual of the search, which is at least 2.5 mm. Chosen by hand;
// not yet measured.
constexpr double kVerificationSigmas = 4.0;
constexpr double kMinResidualSigma_m = 0.0025;
// Time after which a fitted body that was not found in any pose is also searched for in calibration poses, as if it was
// not fitted: another person may wear the markers. Chosen by hand; not yet measured.
constexpr Duration kUnknownBodyDelay = std::chrono::seconds(3);
// LabelSettings::search_work is the work of a set at this rate; at 15 Hz or less it is eight times as much.
constexpr double kWorkRate_hz = 120.0;
constexpr double kMaxWorkSets = 8.0;
// Work of a search for a body of unknown dimensions, as a factor of that of a known body: it happens once in a session
// (decision 0023).
constexpr std::size_t kUncalibratedWork = 2;
constexpr int kFitIterations = 12;
constexpr int kVerificationIterations = 4;

// Whether the position of a track is a point of the any-pose search. The points need not be confirmed tracks, because
// the verification removes clutter. A coasting track is used while the standard deviation of its predicted position is
// at most about that of a marker on its bone (decision 0024).
bool is_point_of_any_pose(const TrackedMarker& track) {
  switch (track.state) {
    case TrackState::Confirmed: return true;
    case TrackState::Tentative: return track.cameras >= kMinTentativeCameras;
    case TrackState::Coasting: return track.covariance_m2.trace() < 3.0 * kMarkerSigma_m * kMarkerSigma_m;
    case TrackState::Candidate: return false;
  }
  return false;
}

}  // namespace

SubjectSearch::SubjectSearch(const LabelSettings& settings, const Subject& subject)
    : settings_(settings),
      set_(subject.marker_set),
      fitted_(subject.fitted),
      tpose_finder_(set_, {.min_marker_fraction = settings.least_share, .max_rms_m = settings.most_rms_m},
                    kMaxSearchPoints),
      calibration_pose_(identify::make_a_pose(set_, identify::kAPoseArmAngle_rad)),
      rigid_finder_(set_, settings.rigid_tolerance_m),
      any_pose_(set_, {}),
      pose_fit_(set_, kinematics::PoseFit::Lengths::Fixed) {
  points_.reserve(kMaxMarkers);
  track_of_point_.reserve(kMaxMarkers);
  uncalibrated_tracks_.reserve(kMaxMarkers);
  if (settings.search_uncalibrated && !rigid()) uncalibrated_.emplace(set_);
  nearest_.reserve(kMaxMarkers);
  observations_.reserve(set_.markers.size());
  if (!calibration_pose_) return;
  const identify::FindSettings find{
      .min_marker_fraction = std::max(settings.least_share, identify::kMinAPoseMarkerFraction),
      .max_rms_m = settings.most_rms_m,
      .max_joint_angle_rad = identify::kMaxAPoseDeviation_rad};
  apose_finder_.emplace(calibration_pose_->set, find, kMaxSearchPoints);
}

void SubjectSearch::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                          std::span<const Eigen::Vector3d> marker_offsets_m) {
  any_pose_.refit(rest_offsets_m, marker_offsets_m);
  pose_fit_.refit(rest_offsets_m, marker_offsets_m);
  fitted_ = true;
  stop();
}

void SubjectSearch::learn_joints(const pose::SkeletonTracker& body) {
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
    any_pose_.set_hinge(b, body.hinge_axes().nominal_from_calibrated(b), body.swivel_planes().plane(b));
    pose_fit_.set_hinge_axis(b, body.hinge_axes().nominal_from_calibrated(b));
    pose_fit_.set_swivel_plane(b, body.swivel_planes().plane(b));
  }
}

// The other finders depend on the definition of the subject and on the settings alone.
void SubjectSearch::adopt(SubjectSearch& before) {
  fitted_ = before.fitted_;
  any_pose_.adopt(before.any_pose_);
  if (uncalibrated_ && before.uncalibrated_) {
    uncalibrated_->adopt(*before.uncalibrated_);
    uncalibrated_tracks_.swap(before.uncalibrated_tracks_);
  }
  pose_fit_ = std::move(before.pose_fit_);
  random_ = before.random_;
  search_apose_next_ = before.search_apose_next_;
  track_of_point_.swap(before.track_of_point_);
  points_.swap(before.points_);
  searched_at_ = before.searched_at_;
  not_found_at_ = before.not_found_at_;
  verified_since_ = before.verified_since_;
  max_residual_m_ = before.max_residual_m_;
  stepped_at_ = before.stepped_at_;
  found_ = before.found_;
}

void SubjectSearch::forget_body() {
  fitted_ = false;
  stop();
}

void SubjectSearch::stop() {
  any_pose_.begin({});
  if (uncalibrated_) uncalibrated_->stop();
  verified_since_.reset();
  searched_at_.reset();
  not_found_at_.reset();
}

// Collects the points of tracks without a label. `point_of`: the point of the track with this index, if the search uses
// it.
template <typename PointOf>
void SubjectSearch::gather(const LabelledTracks& tracks, PointOf point_of) {
  points_.clear();
  track_of_point_.clear();
  for (std::size_t i = 0; i < tracks.tracked->size(); ++i) {
    const TrackedMarker& track = (*tracks.tracked)[i];
    if (tracks.labelled[i] || !track.position.v.allFinite()) continue;
    const std::optional<Eigen::Vector3d> point = point_of(i, track);
    if (!point) continue;
    points_.push_back(*point);
    track_of_point_.push_back(track.id);
  }
}

void SubjectSearch::gather_measured(const LabelledTracks& tracks) {
  gather(tracks, [](std::size_t, const TrackedMarker& track) -> std::optional<Eigen::Vector3d> {
    if (track.state != TrackState::Confirmed) return std::nullopt;
    return track.position.v;
  });
}

// Candidates that have been stationary take part: the fit of a body tells the markers among them from clutter.
void SubjectSearch::gather_stationary(const LabelledTracks& tracks, const StationaryTracks& stationary) {
  gather(tracks, [&](std::size_t i, const TrackedMarker& track) -> std::optional<Eigen::Vector3d> {
    const bool may_be_marker = track.state == TrackState::Confirmed || track.state == TrackState::Candidate;
    if (!may_be_marker || stationary.rest_duration(i) < settings_.still_for) return std::nullopt;
    return stationary.mean(i);
  });
}

void SubjectSearch::gather_for_any_pose(const LabelledTracks& tracks) {
  gather(tracks, [](std::size_t, const TrackedMarker& track) -> std::optional<Eigen::Vector3d> {
    if (!is_point_of_any_pose(track)) return std::nullopt;
    return track.position.v;
  });
  select_cluster(pose::kMaxCloudPoints);
}

// If there are more points than a search can use, keeps the points nearest to a randomly chosen point: these include
// all markers of a person who stands there (decision 0012).
void SubjectSearch::select_cluster(std::size_t most) {
  if (points_.size() <= most) return;
  const Eigen::Vector3d about = points_[random_() % points_.size()];
  nearest_.clear();
  for (std::size_t p = 0; p < points_.size(); ++p) nearest_.emplace_back((points_[p] - about).squaredNorm(), p);
  std::nth_element(nearest_.begin(), nearest_.begin() + static_cast<std::ptrdiff_t>(most), nearest_.end());
  nearest_.resize(most);
  // In ascending order, so that each point is copied to an element that is no longer needed.
  std::sort(nearest_.begin(), nearest_.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (std::size_t i = 0; i < nearest_.size(); ++i) {
    points_[i] = points_[nearest_[i].second];
    track_of_point_[i] = track_of_point_[nearest_[i].second];
  }
  points_.resize(most);
  track_of_point_.resize(most);
}

// The work of a search in this set. At low rates it is in proportion to the time since the set before: a search takes
// as long, and the person has moved as little when it ends (decision 0021).
std::size_t SubjectSearch::work_until(Timestamp at) {
  const double sets = stepped_at_ ? to_s(at - *stepped_at_) * kWorkRate_hz : 1.0;
  stepped_at_ = at;
  return static_cast<std::size_t>(std::clamp(sets, 1.0, kMaxWorkSets) * static_cast<double>(settings_.search_work));
}

const RecognisedSubject* SubjectSearch::step(const LabelledTracks& tracks, const StationaryTracks& stationary,
                                             bool is_only_person, Timestamp at) {
  const std::size_t work = work_until(at);
  if (verified_since_) return verify(tracks, at);
  if (!any_pose_.searching()) {
    if (const RecognisedSubject* const found = begin_search(tracks, stationary, at)) return found;
  }
  if (uncalibrated_ && !has_fitted_body()) {
    is_only_person ? search_uncalibrated(tracks, work, at) : uncalibrated_->stop();
  }
  if (!any_pose_.searching() || !any_pose_.advance(work)) return nullptr;
  if (any_pose_.found()) begin_verification(*any_pose_.found(), track_of_point_, at);
  if (!any_pose_.found() && !not_found_at_) not_found_at_ = at;
  return nullptr;
}

// Searches for a rigid body or a calibration pose at once, if that is due, or begins a search in any pose.
const RecognisedSubject* SubjectSearch::begin_search(const LabelledTracks& tracks, const StationaryTracks& stationary,
                                                     Timestamp at) {
  const bool due = !searched_at_ || at - *searched_at_ >= settings_.search_every || at < *searched_at_;
  const bool is_unknown_body = has_fitted_body() && not_found_at_ && at - *not_found_at_ > kUnknownBodyDelay;
  if (due && (rigid() || !has_fitted_body() || is_unknown_body)) {
    searched_at_ = at;
    if (!rigid()) {
      gather_stationary(tracks, stationary);
      select_cluster(kMaxSearchPoints);
      return search_calibration_pose();
    }
    gather_measured(tracks);
    const std::optional<identify::FoundBody>& found = rigid_finder_.find(points_);
    return found ? accept_calibration_pose(*found) : nullptr;
  }
  if (!has_fitted_body() || rigid()) return nullptr;
  gather_for_any_pose(tracks);
  any_pose_.begin(points_);
  if (!any_pose_.searching()) not_found_at_.reset();
  return nullptr;
}

// Continues the search of a body of unknown dimensions in any pose, or begins one.
void SubjectSearch::search_uncalibrated(const LabelledTracks& tracks, std::size_t work, Timestamp at) {
  if (!uncalibrated_->searching()) {
    gather_for_any_pose(tracks);
    uncalibrated_->begin(points_);
    uncalibrated_tracks_ = track_of_point_;
  }
  if (uncalibrated_->searching() && uncalibrated_->advance(kUncalibratedWork * work) && uncalibrated_->found())
    begin_verification(*uncalibrated_->found(), at);
}

// Searches for T-pose and A-pose in turns, one in a set.
const RecognisedSubject* SubjectSearch::search_calibration_pose() {
  const bool apose = apose_finder_ && search_apose_next_;
  search_apose_next_ = !search_apose_next_;
  const std::optional<identify::FoundBody>& found = apose ? apose_finder_->find(points_) : tpose_finder_.find(points_);
  if (!found) return nullptr;
  const RecognisedSubject* const taken = accept_calibration_pose(*found);
  if (!apose) return taken;
  // Transform the fitted offsets from the bone frames of the A-pose to those of the rest pose.
  for (std::size_t b = 0; b < found_.rest_offsets_m.size(); ++b) {
    const int parent = set_.skeleton.bones[b].parent;
    if (parent < 0) continue;
    Eigen::Vector3d& offset_m = found_.rest_offsets_m[b];
    offset_m = calibration_pose_->rotations[static_cast<std::size_t>(parent)].conjugate() * offset_m;
  }
  for (std::size_t m = 0; m < found_.marker_offsets_m.size(); ++m) {
    Eigen::Vector3d& offset_m = found_.marker_offsets_m[m];
    offset_m = calibration_pose_->rotations[static_cast<std::size_t>(set_.markers[m].bone)].conjugate() * offset_m;
  }
  return taken;
}

const RecognisedSubject* SubjectSearch::accept_calibration_pose(const identify::FoundBody& found) {
  set_tracks(found.point_of_marker, track_of_point_);
  found_.locals.clear();
  found_.is_newly_fitted = !rigid();
  found_.in_any_pose = false;
  found_.rest_offsets_m = found.rest_offsets_m;
  found_.marker_offsets_m = found.marker_offsets_m;
  found_.rms_m = found.rms_m;
  return &found_;
}

void SubjectSearch::set_tracks(std::span<const int> point_of_marker, std::span<const TrackId> track_of_point) {
  found_.track_of_marker.clear();
  for (const int p : point_of_marker)
    found_.track_of_marker.push_back(p < 0 ? TrackId{} : track_of_point[static_cast<std::size_t>(p)]);
}

void SubjectSearch::begin_verification(const identify::FoundPose& found, std::span<const TrackId> track_of_point,
                                       Timestamp at) {
  set_tracks(found.point_of_marker, track_of_point);
  found_.locals = found.locals;
  found_.is_newly_fitted = found_.in_any_pose = false;
  found_.rms_m = found.rms_m;
  max_residual_m_ = kVerificationSigmas * std::max(kMinResidualSigma_m, found.rms_m);
  verified_since_ = at;
}

void SubjectSearch::begin_verification(const identify::FoundUncalibratedBody& found, Timestamp at) {
  begin_verification(found.pose, uncalibrated_tracks_, at);
  found_.is_newly_fitted = found_.in_any_pose = true;
  found_.rest_offsets_m = found.rest_offsets_m;
  found_.marker_offsets_m = found.marker_offsets_m;
  found_.rms_m = found.rms_m;
  pose_fit_.refit(found.rest_offsets_m, found.marker_offsets_m);
}

// Fits the pose, from the pose that was found, to the tracks of this set; returns half the sum of squared residuals.
double SubjectSearch::fit(const LabelledTracks& tracks, const RecognisedSubject& recognised, int iterations) {
  observations_.clear();
  for (std::size_t m = 0; m < recognised.track_of_marker.size(); ++m) {
    const TrackId id = recognised.track_of_marker[m];
    const int index = id.names_something() ? tracks.find(id) : LabelledTracks::kNone;
    if (index < 0 || tracks[index].state == TrackState::Coasting) continue;
    observations_.push_back({static_cast<int>(m), tracks[index].position.v, kMarkerSigma_m});
  }
  kinematics::PosePrior prior;
  prior.rest_range_fraction = kinematics::kRestRangeFraction;
  prior.limit_sigma_rad = kinematics::kRangeSigma_rad;
  pose_fit_.set_locals(recognised.locals);
  return pose_fit_.solve(observations_, prior, iterations).cost;
}

// Whether a track of the identification is there, and none of them could be measured in this set.
bool SubjectSearch::is_unobserved(const LabelledTracks& tracks) const {
  bool is_there = false;
  for (const TrackId id : found_.track_of_marker) {
    const int index = id.names_something() ? tracks.find(id) : LabelledTracks::kNone;
    if (index < 0) continue;
    if (tracks[index].state != TrackState::Coasting || tracks[index].missed_sets > 0) return false;
    is_there = true;
  }
  return is_there;
}

// Verifies the identification in one set: removes tracks outside the gate. Ends the verification if these are more than
// half of the tracks that were measured, or if fewer than a quarter of the markers remain, which is the least that
// keeps a body tracked. A marker that is not measured is no evidence (decision 0021).
const RecognisedSubject* SubjectSearch::verify(const LabelledTracks& tracks, Timestamp at) {
  if (is_unobserved(tracks)) return nullptr;
  (void)fit(tracks, found_, kVerificationIterations);
  std::size_t kept_count = 0;
  for (const kinematics::Observation& one : observations_) {
    const auto m = static_cast<std::size_t>(one.marker);
    const bool off = !((pose_fit_.marker_at(m) - one.position).norm() < max_residual_m_);
    const int index = tracks.find(found_.track_of_marker[m]);
    if (off || tracks.labelled[static_cast<std::size_t>(index)]) {
      found_.track_of_marker[m] = {};
    } else {
      ++kept_count;
    }
  }
  std::copy(pose_fit_.locals().begin(), pose_fit_.locals().end(), found_.locals.begin());
  if (2 * kept_count < observations_.size() || 4 * kept_count < set_.markers.size()) {
    stop();
    return nullptr;
  }
  if (at >= *verified_since_ && at - *verified_since_ < kVerificationTime) return nullptr;
  verified_since_.reset();
  return &found_;
}

std::optional<double> SubjectSearch::residual_cost(const RecognisedSubject& other, const LabelledTracks& tracks) {
  if (!has_fitted_body() || other.is_newly_fitted || other.track_of_marker.size() != set_.markers.size() ||
      other.locals.size() != set_.skeleton.bones.size())
    return std::nullopt;
  return fit(tracks, other, kFitIterations);
}

// As in `adopt`, the other finders have no belief.
void SubjectSearch::archive(Archive& members) {
  members(fitted_, search_apose_next_, any_pose_, pose_fit_, track_of_point_, random_, searched_at_, not_found_at_);
  members(stepped_at_, verified_since_, max_residual_m_, found_);
  if (uncalibrated_) members(*uncalibrated_, uncalibrated_tracks_);
  if (!members.is_reading()) return;
  const bool has_tracks = !any_pose_.searching() || any_pose_.point_count() <= track_of_point_.size();
  const bool has_uncalibrated_tracks =
      !uncalibrated_ || !uncalibrated_->searching() || uncalibrated_->point_count() <= uncalibrated_tracks_.size();
  const bool has_pose =
      found_.track_of_marker.size() == set_.markers.size() && found_.locals.size() == set_.skeleton.bones.size();
  if (!has_tracks || !has_uncalibrated_tracks || (verified_since_ && !has_pose)) members.fail();
}

}  // namespace mocap::label
