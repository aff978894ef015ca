#include "label/subject_search.h"

#include <algorithm>
#include <cmath>

namespace mocap::label {
namespace {

// More points than any T-pose with its ghosts has; bounds the cost of a search.
constexpr std::size_t kMostPoints = 160;
// What is found must hold for so many sets: a person who moves at 1 m/s has gone 3 cm at 120 Hz, and a ghost has not.
constexpr int kSetsToHold = 4;
// Four standard deviations of a marker from its body, of which no fit knows less than 2.5 mm.
constexpr double kHoldSigmas = 4.0;
constexpr double kLeastSigma_m = 0.0025;
constexpr double kMarkerSigma_m = 0.004;
// Who is not found in any pose for so long may be found standing, as if not known: somebody else may wear the markers.
constexpr Duration kStranger = std::chrono::seconds(3);
constexpr double kRange_rad = 0.3;
constexpr double kRestShare = 0.5;
constexpr int kFitIterations = 12;
constexpr int kHoldIterations = 4;
// Arms of an A-pose, below T-pose; and how far from that, by any joint, it is none: 12 degrees. Readings of what is
// further off begin to have wrong names.
constexpr double kArmsLowered_rad = 0.785;
constexpr double kMostOffAPose_rad = 0.2;
constexpr double kLeastShareInAPose = 0.96;  // of the markers, likewise

}  // namespace

SubjectSearch::SubjectSearch(const LabelSettings& settings, const Subject& subject)
    : settings_(settings),
      set_(subject.marker_set),
      fitted_(subject.fitted),
      tpose_(set_, {.least_share = settings.least_share, .most_rms_m = settings.most_rms_m}, kMostPoints),
      stance_(identify::a_pose(set_, kArmsLowered_rad)),
      shape_(set_, settings.rigid_tolerance_m),
      any_(set_, {}),
      pose_(set_, kinematics::PoseFit::Lengths::Fixed) {
  points_.reserve(kMaxMarkers);
  track_of_point_.reserve(kMaxMarkers);
  nearest_.reserve(kMaxMarkers);
  seen_.reserve(set_.markers.size());
  if (!stance_) return;
  const identify::FindSettings find{.least_share = std::max(settings.least_share, kLeastShareInAPose),
                                .most_rms_m = settings.most_rms_m,
                                .most_turn_rad = kMostOffAPose_rad};
  apose_.emplace(stance_->set, find, kMostPoints);
}

void SubjectSearch::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                          std::span<const Eigen::Vector3d> marker_offsets_m) {
  any_.refit(rest_offsets_m, marker_offsets_m);
  pose_.refit(rest_offsets_m, marker_offsets_m);
  fitted_ = true;
  stop();
}

void SubjectSearch::know_joints(const pose::BodyFollower& body) {
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
    any_.bend(b, body.leans().as_in_file(b), body.planes().plane(b));
    pose_.lean(b, body.leans().as_in_file(b));
    pose_.bend_in(b, body.planes().plane(b));
  }
}

void SubjectSearch::forget_body() {
  fitted_ = false;
  stop();
}

void SubjectSearch::stop() {
  any_.begin({});
  sets_to_hold_ = 0;
  looked_at_.reset();
  not_found_at_.reset();
}

void SubjectSearch::gather(const NamedTracks& tracks, const StillTracks& still, Duration still_for) {
  points_.clear();
  track_of_point_.clear();
  for (std::size_t i = 0; i < tracks.tracked->size(); ++i) {
    const TrackedMarker& track = (*tracks.tracked)[i];
    const bool there = track.state == TrackState::Confirmed && track.position.v.allFinite();
    if (!there || tracks.named[i] || still.rested(i) < still_for) continue;
    points_.push_back(still_for > Duration{0} ? still.mean(i) : track.position.v);
    track_of_point_.push_back(track.id);
  }
}

// A crowd is looked at in parts: the points about any one of them. A person who stands there is among them as a whole.
void SubjectSearch::keep_those_about_one(std::size_t most) {
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

const Recognised* SubjectSearch::step(const NamedTracks& tracks, const StillTracks& still, Timestamp at) {
  if (sets_to_hold_ > 0) return hold(tracks);
  if (any_.searching()) {
    if (!any_.advance(settings_.search_work)) return nullptr;
    if (any_.found()) begin_to_hold();
    if (!any_.found() && !not_found_at_) not_found_at_ = at;
    return nullptr;
  }
  const bool due = !looked_at_ || at - *looked_at_ >= settings_.search_every || at < *looked_at_;
  const bool stranger = knows_body() && not_found_at_ && at - *not_found_at_ > kStranger;
  if (due && (rigid() || !knows_body() || stranger)) {
    looked_at_ = at;
    gather(tracks, still, rigid() ? Duration{0} : settings_.still_for);
    if (!rigid()) {
      keep_those_about_one(kMostPoints);
      return look_for_standing();
    }
    const std::optional<identify::FoundBody>& found = shape_.find(points_);
    return found ? take_standing(*found) : nullptr;
  }
  if (!knows_body() || rigid()) return nullptr;
  gather(tracks, still, Duration{0});
  keep_those_about_one(pose::kMostCloudPoints);
  any_.begin(points_);
  if (!any_.searching()) not_found_at_.reset();
  return nullptr;
}

// T-pose and A-pose in turns: one search a set.
const Recognised* SubjectSearch::look_for_standing() {
  const bool apose = apose_ && look_for_apose_;
  look_for_apose_ = !look_for_apose_;
  const std::optional<identify::FoundBody>& found = apose ? apose_->find(points_) : tpose_.find(points_);
  if (!found) return nullptr;
  const Recognised* const taken = take_standing(*found);
  if (!apose) return taken;
  // As seen from the bones of the rest pose.
  for (std::size_t b = 0; b < found_.rest_offsets_m.size(); ++b) {
    const int parent = set_.skeleton.bones[b].parent;
    if (parent < 0) continue;
    Eigen::Vector3d& offset_m = found_.rest_offsets_m[b];
    offset_m = stance_->turned[static_cast<std::size_t>(parent)].conjugate() * offset_m;
  }
  for (std::size_t m = 0; m < found_.marker_offsets_m.size(); ++m) {
    Eigen::Vector3d& offset_m = found_.marker_offsets_m[m];
    offset_m = stance_->turned[static_cast<std::size_t>(set_.markers[m].bone)].conjugate() * offset_m;
  }
  return taken;
}

const Recognised* SubjectSearch::take_standing(const identify::FoundBody& found) {
  found_.track_of_marker.clear();
  for (const int p : found.point_of_marker)
    found_.track_of_marker.push_back(p < 0 ? TrackId{} : track_of_point_[static_cast<std::size_t>(p)]);
  found_.locals.clear();
  found_.fitted_now = !rigid();
  found_.rest_offsets_m = found.rest_offsets_m;
  found_.marker_offsets_m = found.marker_offsets_m;
  found_.rms_m = found.rms_m;
  return &found_;
}

void SubjectSearch::begin_to_hold() {
  const identify::FoundPose& found = *any_.found();
  found_.track_of_marker.clear();
  for (const int p : found.point_of_marker)
    found_.track_of_marker.push_back(p < 0 ? TrackId{} : track_of_point_[static_cast<std::size_t>(p)]);
  found_.locals = found.locals;
  found_.fitted_now = false;
  found_.rms_m = found.rms_m;
  most_off_m_ = kHoldSigmas * std::max(kLeastSigma_m, found.rms_m);
  sets_to_hold_ = kSetsToHold;
}

double SubjectSearch::fit(const NamedTracks& tracks, const Recognised& names, int iterations) {
  seen_.clear();
  for (std::size_t m = 0; m < names.track_of_marker.size(); ++m) {
    const TrackId id = names.track_of_marker[m];
    const int index = id.names_something() ? tracks.find(id) : NamedTracks::kNone;
    if (index < 0 || tracks[index].state == TrackState::Coasting) continue;
    seen_.push_back({static_cast<int>(m), tracks[index].position.v, kMarkerSigma_m});
  }
  kinematics::PosePrior prior;
  prior.rest_share = kRestShare;
  prior.limit_sigma_rad = kRange_rad;
  pose_.set_locals(names.locals);
  return pose_.solve(seen_, prior, iterations).cost;
}

// Follows what was found for a set; lets go of what does not go with the body, and of all when that leaves too little.
const Recognised* SubjectSearch::hold(const NamedTracks& tracks) {
  (void)fit(tracks, found_, kHoldIterations);
  std::size_t kept = 0;
  for (const kinematics::Observation& one : seen_) {
    const auto m = static_cast<std::size_t>(one.marker);
    const bool off = !((pose_.marker_at(m) - one.position).norm() < most_off_m_);
    const int index = tracks.find(found_.track_of_marker[m]);
    if (off || tracks.named[static_cast<std::size_t>(index)]) {
      found_.track_of_marker[m] = {};
    } else {
      ++kept;
    }
  }
  std::copy(pose_.locals().begin(), pose_.locals().end(), found_.locals.begin());
  if (2 * kept < set_.markers.size()) {
    stop();
    return nullptr;
  }
  return --sets_to_hold_ > 0 ? nullptr : &found_;
}

std::optional<double> SubjectSearch::explain(const Recognised& other, const NamedTracks& tracks) {
  if (!knows_body() || other.fitted_now || other.track_of_marker.size() != set_.markers.size() ||
      other.locals.size() != set_.skeleton.bones.size())
    return std::nullopt;
  return fit(tracks, other, kFitIterations);
}

}  // namespace mocap::label
