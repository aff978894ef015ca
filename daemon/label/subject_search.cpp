#include "label/subject_search.h"

#include <algorithm>
#include <cmath>

namespace mocap::label {
namespace {

// More points than any T-pose with its ghosts has; bounds the cost of a search.
constexpr std::size_t kMaxSearchPoints = 160;
// What is found must hold for so many sets: a person who moves at 1 m/s has gone 3 cm at 120 Hz, and a ghost has not.
constexpr int kVerificationSets = 4;
// Four standard deviations of a marker from its body, of which no fit knows less than 2.5 mm.
constexpr double kVerificationSigmas = 4.0;
constexpr double kLeastSigma_m = 0.0025;
constexpr double kMarkerSigma_m = 0.004;
// Who is not found in any pose for so long may be found standing, as if not known: somebody else may wear the markers.
constexpr Duration kUnknownBodyDelay = std::chrono::seconds(3);
constexpr double kRangeSigma_rad = 0.3;
constexpr double kRestRangeFraction = 0.5;
constexpr int kFitIterations = 12;
constexpr int kVerificationIterations = 4;
// Arms of an A-pose, below T-pose; and how far from that, by any joint, it is none: 12 degrees. Readings of what is
// further off begin to have wrong names.
constexpr double kAPoseArmAngle_rad = 0.785;
constexpr double kMaxAPoseDeviation_rad = 0.2;
constexpr double kMinShareInAPose = 0.96;  // of the markers, likewise

}  // namespace

SubjectSearch::SubjectSearch(const LabelSettings& settings, const Subject& subject)
    : settings_(settings),
      set_(subject.marker_set),
      fitted_(subject.fitted),
      tpose_(set_, {.min_marker_fraction = settings.least_share, .max_rms_m = settings.most_rms_m}, kMaxSearchPoints),
      stance_(identify::make_a_pose(set_, kAPoseArmAngle_rad)),
      shape_(set_, settings.rigid_tolerance_m),
      any_(set_, {}),
      pose_(set_, kinematics::PoseFit::Lengths::Fixed) {
  points_.reserve(kMaxMarkers);
  track_of_point_.reserve(kMaxMarkers);
  nearest_.reserve(kMaxMarkers);
  observations_.reserve(set_.markers.size());
  if (!stance_) return;
  const identify::FindSettings find{.min_marker_fraction = std::max(settings.least_share, kMinShareInAPose),
                                    .max_rms_m = settings.most_rms_m,
                                    .max_joint_angle_rad = kMaxAPoseDeviation_rad};
  apose_.emplace(stance_->set, find, kMaxSearchPoints);
}

void SubjectSearch::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                          std::span<const Eigen::Vector3d> marker_offsets_m) {
  any_.refit(rest_offsets_m, marker_offsets_m);
  pose_.refit(rest_offsets_m, marker_offsets_m);
  fitted_ = true;
  stop();
}

void SubjectSearch::learn_joints(const pose::SkeletonTracker& body) {
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
    any_.set_hinge(b, body.hinge_axes().nominal_from_calibrated(b), body.swivel_planes().plane(b));
    pose_.set_hinge_axis(b, body.hinge_axes().nominal_from_calibrated(b));
    pose_.set_swivel_plane(b, body.swivel_planes().plane(b));
  }
}

void SubjectSearch::forget_body() {
  fitted_ = false;
  stop();
}

void SubjectSearch::stop() {
  any_.begin({});
  sets_to_verify_ = 0;
  searched_at_.reset();
  not_found_at_.reset();
}

void SubjectSearch::gather(const LabelledTracks& tracks, const StationaryTracks& stationary, Duration still_for) {
  points_.clear();
  track_of_point_.clear();
  for (std::size_t i = 0; i < tracks.tracked->size(); ++i) {
    const TrackedMarker& track = (*tracks.tracked)[i];
    const bool there = track.state == TrackState::Confirmed && track.position.v.allFinite();
    if (!there || tracks.labelled[i] || stationary.rest_duration(i) < still_for) continue;
    points_.push_back(still_for > Duration{0} ? stationary.mean(i) : track.position.v);
    track_of_point_.push_back(track.id);
  }
}

// A crowd is looked at in parts: the points about any one of them. A person who stands there is among them as a whole.
void SubjectSearch::select_cluster(std::size_t most) {
  if (points_.size() <= most) return;
  const Eigen::Vector3d about = points_[random_() % points_.size()];
  nearest_.clear();
  for (std::size_t p = 0; p < points_.size(); ++p) nearest_.emplace_back((points_[p] - about).squaredNorm(), p);
  std::nth_element(nearest_.begin(), nearest_.begin() + static_cast<std::ptrdiff_t>(most), nearest_.end());
  nearest_.resize(most);
  // In their order, so that each goes to a place that is not needed any more.
  std::sort(nearest_.begin(), nearest_.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (std::size_t i = 0; i < nearest_.size(); ++i) {
    points_[i] = points_[nearest_[i].second];
    track_of_point_[i] = track_of_point_[nearest_[i].second];
  }
  points_.resize(most);
  track_of_point_.resize(most);
}

const RecognisedSubject* SubjectSearch::step(const LabelledTracks& tracks, const StationaryTracks& stationary,
                                             Timestamp at) {
  if (sets_to_verify_ > 0) return verify(tracks);
  if (any_.searching()) {
    if (!any_.advance(settings_.search_work)) return nullptr;
    if (any_.found()) begin_verification();
    if (!any_.found() && !not_found_at_) not_found_at_ = at;
    return nullptr;
  }
  const bool due = !searched_at_ || at - *searched_at_ >= settings_.search_every || at < *searched_at_;
  const bool is_unknown_body = has_fitted_body() && not_found_at_ && at - *not_found_at_ > kUnknownBodyDelay;
  if (due && (rigid() || !has_fitted_body() || is_unknown_body)) {
    searched_at_ = at;
    gather(tracks, stationary, rigid() ? Duration{0} : settings_.still_for);
    if (!rigid()) {
      select_cluster(kMaxSearchPoints);
      return search_calibration_pose();
    }
    const std::optional<identify::FoundBody>& found = shape_.find(points_);
    return found ? accept_calibration_pose(*found) : nullptr;
  }
  if (!has_fitted_body() || rigid()) return nullptr;
  gather(tracks, stationary, Duration{0});
  select_cluster(pose::kMaxCloudPoints);
  any_.begin(points_);
  if (!any_.searching()) not_found_at_.reset();
  return nullptr;
}

// T-pose and A-pose in turns: one search a set.
const RecognisedSubject* SubjectSearch::search_calibration_pose() {
  const bool apose = apose_ && search_apose_next_;
  search_apose_next_ = !search_apose_next_;
  const std::optional<identify::FoundBody>& found = apose ? apose_->find(points_) : tpose_.find(points_);
  if (!found) return nullptr;
  const RecognisedSubject* const taken = accept_calibration_pose(*found);
  if (!apose) return taken;
  // As seen from the bones of the rest pose.
  for (std::size_t b = 0; b < found_.rest_offsets_m.size(); ++b) {
    const int parent = set_.skeleton.bones[b].parent;
    if (parent < 0) continue;
    Eigen::Vector3d& offset_m = found_.rest_offsets_m[b];
    offset_m = stance_->rotations[static_cast<std::size_t>(parent)].conjugate() * offset_m;
  }
  for (std::size_t m = 0; m < found_.marker_offsets_m.size(); ++m) {
    Eigen::Vector3d& offset_m = found_.marker_offsets_m[m];
    offset_m = stance_->rotations[static_cast<std::size_t>(set_.markers[m].bone)].conjugate() * offset_m;
  }
  return taken;
}

const RecognisedSubject* SubjectSearch::accept_calibration_pose(const identify::FoundBody& found) {
  found_.track_of_marker.clear();
  for (const int p : found.point_of_marker)
    found_.track_of_marker.push_back(p < 0 ? TrackId{} : track_of_point_[static_cast<std::size_t>(p)]);
  found_.locals.clear();
  found_.is_newly_fitted = !rigid();
  found_.rest_offsets_m = found.rest_offsets_m;
  found_.marker_offsets_m = found.marker_offsets_m;
  found_.rms_m = found.rms_m;
  return &found_;
}

void SubjectSearch::begin_verification() {
  const identify::FoundPose& found = *any_.found();
  found_.track_of_marker.clear();
  for (const int p : found.point_of_marker)
    found_.track_of_marker.push_back(p < 0 ? TrackId{} : track_of_point_[static_cast<std::size_t>(p)]);
  found_.locals = found.locals;
  found_.is_newly_fitted = false;
  found_.rms_m = found.rms_m;
  max_residual_m_ = kVerificationSigmas * std::max(kLeastSigma_m, found.rms_m);
  sets_to_verify_ = kVerificationSets;
}

double SubjectSearch::fit(const LabelledTracks& tracks, const RecognisedSubject& recognised, int iterations) {
  observations_.clear();
  for (std::size_t m = 0; m < recognised.track_of_marker.size(); ++m) {
    const TrackId id = recognised.track_of_marker[m];
    const int index = id.names_something() ? tracks.find(id) : LabelledTracks::kNone;
    if (index < 0 || tracks[index].state == TrackState::Coasting) continue;
    observations_.push_back({static_cast<int>(m), tracks[index].position.v, kMarkerSigma_m});
  }
  kinematics::PosePrior prior;
  prior.rest_range_fraction = kRestRangeFraction;
  prior.limit_sigma_rad = kRangeSigma_rad;
  pose_.set_locals(recognised.locals);
  return pose_.solve(observations_, prior, iterations).cost;
}

// Follows what was found for a set; lets go of what does not go with the body, and of all when that leaves too little.
const RecognisedSubject* SubjectSearch::verify(const LabelledTracks& tracks) {
  (void)fit(tracks, found_, kVerificationIterations);
  std::size_t kept_count = 0;
  for (const kinematics::Observation& one : observations_) {
    const auto m = static_cast<std::size_t>(one.marker);
    const bool off = !((pose_.marker_at(m) - one.position).norm() < max_residual_m_);
    const int index = tracks.find(found_.track_of_marker[m]);
    if (off || tracks.labelled[static_cast<std::size_t>(index)]) {
      found_.track_of_marker[m] = {};
    } else {
      ++kept_count;
    }
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), found_.locals.begin());
  if (2 * kept_count < set_.markers.size()) {
    stop();
    return nullptr;
  }
  return --sets_to_verify_ > 0 ? nullptr : &found_;
}

std::optional<double> SubjectSearch::residual_cost(const RecognisedSubject& other, const LabelledTracks& tracks) {
  if (!has_fitted_body() || other.is_newly_fitted || other.track_of_marker.size() != set_.markers.size() ||
      other.locals.size() != set_.skeleton.bones.size())
    return std::nullopt;
  return fit(tracks, other, kFitIterations);
}

}  // namespace mocap::label
