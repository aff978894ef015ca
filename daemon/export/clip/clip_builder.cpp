#include "export/clip/clip_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "export/clip/clip_timecode.h"
#include "export/clip/rates.h"

namespace mocap::exports {
namespace {

Error wrong(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

// A take with more missing frames than this for each snapshot has wrong times, or is several takes in one.
constexpr std::int64_t kMaxFramesPerSnapshot = 50;
constexpr std::int64_t kFramesAlwaysAllowed = 100'000;

// Clocks of cameras and hosts differ by up to 300 ppm; 29.97 and 30 Hz by 1000 ppm.
constexpr double kClockError = 3e-4;
// The times of the first and the last frame have errors, here up to 5 % of a period.
constexpr double kTimeError_periods = 0.05;

// How a marker set becomes another one; empty if both have the same markers and bones in the same order.
std::string change_of(const MarkerSet& before, const MarkerSet& now) {
  const auto& bones = before.skeleton.bones;
  if (before.markers.size() != now.markers.size() || bones.size() != now.skeleton.bones.size()) {
    return fmt::format("from {} markers and {} bones to {} and {}", before.markers.size(), bones.size(),
                       now.markers.size(), now.skeleton.bones.size());
  }
  for (std::size_t m = 0; m < now.markers.size(); ++m) {
    if (before.markers[m].name == now.markers[m].name) continue;
    return fmt::format("the name of marker {} from '{}' to '{}'", m, before.markers[m].name, now.markers[m].name);
  }
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const Bone &old = bones[b], &bone = now.skeleton.bones[b];
    if (old.name == bone.name && old.parent == bone.parent) continue;
    return fmt::format("bone {} from '{}' below bone {} to '{}' below bone {}", b, old.name, old.parent, bone.name,
                       bone.parent);
  }
  return {};
}

template <class Samples>
Samples spread(Samples& rows, std::size_t width, const std::vector<std::int64_t>& frame_of, std::size_t frames) {
  Samples all(frames * width);
  rows.resize(frame_of.size() * width);
  for (std::size_t row = 0; row < frame_of.size(); ++row) {
    if (frame_of[row] < 0) continue;
    std::copy_n(rows.begin() + static_cast<std::ptrdiff_t>(row * width), width,
                all.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(frame_of[row]) * width));
  }
  Samples().swap(rows);
  return all;
}

}  // namespace

ClipBuilder::ClipBuilder(std::string name, std::vector<std::string> subjects)
    : name_(std::move(name)), wanted_(std::move(subjects)) {}

bool ClipBuilder::wanted(const std::string& subject) const {
  return wanted_.empty() || std::find(wanted_.begin(), wanted_.end(), subject) != wanted_.end();
}

Status ClipBuilder::learn(const Description& description) {
  producer_ = description.producer;
  nominal_rate_hz_ = description.nominal_rate_hz;
  viewpoints_.clear();
  for (const CameraModel& camera : description.cameras) {
    viewpoints_.push_back(
        {camera.camera_from_world.inverse().translation, 0.5 * (camera.lens.fx_px + camera.lens.fy_px)});
  }
  track_by_index_.clear();
  for (const Subject& subject : description.subjects) {
    track_by_index_.push_back(-1);
    names_.insert(subject.name);
    if (!wanted(subject.name)) continue;
    if (const Status learnt = learn(subject); !learnt) return learnt;
    const auto same = [&](const Track& track) { return track.rows.subject.name == subject.name; };
    track_by_index_.back() = static_cast<int>(std::find_if(tracks_.begin(), tracks_.end(), same) - tracks_.begin());
  }
  return {};
}

Status ClipBuilder::learn(const Subject& subject) {
  for (Track& track : tracks_) {
    Subject& known = track.rows.subject;
    if (known.name != subject.name) continue;
    if (const std::string change = change_of(known.marker_set, subject.marker_set); !change.empty()) {
      return wrong(
          fmt::format("subject '{}' changes {} at snapshot {}; one file cannot hold both: choose the other "
                      "subjects with --subject, or track the take again with 'mocapctl take retrack'",
                      subject.name, change, times_.size()));
    }
    known = subject;
    return {};
  }
  tracks_.emplace_back();
  tracks_.back().rows.subject = subject;
  return {};
}

ClipBuilder::Track* ClipBuilder::track_of(SubjectId subject) {
  const int track = subject.value < track_by_index_.size() ? track_by_index_[subject.value] : -1;
  return track < 0 ? nullptr : &tracks_[static_cast<std::size_t>(track)];
}

Status ClipBuilder::add(const Snapshot& snapshot, std::optional<std::int64_t> utc_minus_host_ns) {
  if (times_.empty()) utc_minus_host_ns_ = utc_minus_host_ns;
  if (snapshot.timecode && !timecode_) {
    timecode_ = snapshot.timecode;
    timecode_at_ = times_.size();
  }
  times_.push_back(snapshot.instants.exposed_at);
  numbers_.push_back(snapshot.number);
  for (const SubjectLabels& labels : snapshot.labels) {
    if (const Status added = add_markers(labels); !added) return added;
  }
  for (const SubjectPose& pose : snapshot.poses) {
    if (const Status added = add_bones(pose); !added) return added;
  }
  return {};
}

Status ClipBuilder::add_markers(const SubjectLabels& labels) {
  Track* track = track_of(labels.subject);
  if (track == nullptr) return {};
  const std::size_t width = track->rows.subject.marker_set.markers.size();
  if (labels.markers.empty()) return {};
  if (labels.markers.size() != width) {
    return wrong(fmt::format("snapshot {}: subject '{}' has {} markers, expected {}", numbers_.back(),
                             track->rows.subject.name, labels.markers.size(), width));
  }
  std::vector<MarkerSample>& rows = track->rows.markers;
  rows.resize((times_.size() - 1) * width);
  for (const LabelledMarker& marker : labels.markers) {
    MarkerSample& sample = rows.emplace_back();
    if (marker.state == LabelState::Lost) continue;
    sample.state = marker.state;
    sample.position_m = marker.position.v;
    sample.cameras = static_cast<std::uint8_t>(std::min<std::uint32_t>(marker.cameras, 255));
    if (marker.residual_px > 0.0) {
      sample.residual_m = static_cast<float>(marker.residual_px * metres_per_px(marker.position.v));
    }
  }
  return {};
}

Status ClipBuilder::add_bones(const SubjectPose& pose) {
  Track* track = track_of(pose.subject);
  if (track == nullptr || pose.bones.empty()) return {};
  const std::size_t width = track->rows.subject.marker_set.skeleton.bones.size();
  if (pose.bones.size() != width) {
    return wrong(fmt::format("snapshot {}: subject '{}' has {} bones, expected {}", numbers_.back(),
                             track->rows.subject.name, pose.bones.size(), width));
  }
  std::vector<BoneSample>& rows = track->rows.bones;
  rows.resize((times_.size() - 1) * width);
  for (const BonePose& bone : pose.bones) {
    rows.push_back(bone.state == BoneState::Lost ? BoneSample{} : BoneSample{bone.parent_from_bone, bone.state});
  }
  return {};
}

void ClipBuilder::mark(Timestamp at, std::string name) { marks_.push_back({at, std::move(name)}); }

// Length that one pixel covers at a point, mean over the cameras: the snapshot does not say which of them saw it.
double ClipBuilder::metres_per_px(const Eigen::Vector3d& at_m) const {
  double sum = 0.0;
  for (const Viewpoint& camera : viewpoints_) sum += (at_m - camera.at_m).norm() / camera.focal_px;
  return viewpoints_.empty() ? 0.0 : sum / static_cast<double>(viewpoints_.size());
}

// 0 if no two snapshots follow each other in time.
double ClipBuilder::period_s() const {
  std::vector<double> periods;
  for (std::size_t i = 1; i < times_.size(); ++i) {
    const double step_s = to_s(times_[i] - times_[i - 1]);
    const std::uint64_t sets = numbers_[i] > numbers_[i - 1] ? numbers_[i] - numbers_[i - 1] : 1;
    if (step_s > 0.0) periods.push_back(step_s / static_cast<double>(sets));
  }
  if (periods.empty()) return 0.0;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

// The frame of each snapshot; -1: left out.
std::vector<std::int64_t> ClipBuilder::frames_at(double period_s) {
  std::vector<std::int64_t> frame_of(times_.size(), -1);
  frame_of[0] = 0;
  std::size_t last = 0;
  for (std::size_t i = 1; i < times_.size(); ++i) {
    const double step = period_s > 0.0 ? std::round(to_s(times_[i] - times_[last]) / period_s) : 0.0;
    if (step < 1.0) continue;
    frame_of[i] = frame_of[last] + static_cast<std::int64_t>(std::min(step, 1e12));
    last = i;
  }
  return frame_of;
}

Rate ClipBuilder::rate_for(double period_s, std::int64_t last_frame) const {
  if (!(period_s > 0.0)) return nominal_rate_hz_ > 0.0 ? rate_of(nominal_rate_hz_) : Rate{};
  const double span_s = to_s(*std::max_element(times_.begin(), times_.end()) - times_.front());
  const double mean_hz = static_cast<double>(last_frame) / span_s;
  const double tolerance = kClockError + kTimeError_periods / static_cast<double>(last_frame);
  const double whole = std::max(1.0, std::round(mean_hz)), fractional = std::max(1.0, std::round(1.001 * mean_hz));
  for (const double usual_hz : {nominal_rate_hz_, whole, fractional / 1.001}) {
    if (std::abs(usual_hz / mean_hz - 1.0) < tolerance) return rate_of(usual_hz);
  }
  return rate_of(std::max(mean_hz, 1e-3));
}

Status ClipBuilder::check_subjects() const {
  if (names_.empty()) return wrong("the take has no subject");
  for (const std::string& name : wanted_) {
    if (names_.contains(name)) continue;
    return wrong(fmt::format("the take has no subject '{}'; its subjects are '{}'", name, fmt::join(names_, "', '")));
  }
  return {};
}

// The time of an event is counted from the nearest snapshot, as frames are: the clip's rate may be that of another
// clock than the times.
void ClipBuilder::add_events(Clip& clip, double period_s, const std::vector<std::int64_t>& frame_of) {
  std::vector<std::size_t> used;  // snapshots, by time
  for (std::size_t i = 0; i < times_.size(); ++i) {
    if (frame_of[i] >= 0) used.push_back(i);
  }
  for (Mark& mark : marks_) {
    auto nearest = std::lower_bound(used.begin(), used.end(), mark.at,
                                    [&](std::size_t i, Timestamp at) { return times_[i] < at; });
    const bool before = nearest != used.begin() &&
                        (nearest == used.end() || mark.at - times_[*(nearest - 1)] < times_[*nearest] - mark.at);
    if (before) --nearest;
    const double steps = period_s > 0.0 ? std::round(to_s(mark.at - times_[*nearest]) / period_s) : 0.0;
    const double frame = static_cast<double>(frame_of[*nearest]) + steps;
    if (frame < 0.0 || frame >= static_cast<double>(clip.frames)) {
      ++report_.marks_outside;
      continue;
    }
    clip.events.push_back({clip.rate.time_s(static_cast<std::int64_t>(frame)), std::move(mark.name)});
  }
  std::stable_sort(clip.events.begin(), clip.events.end(),
                   [](const ClipEvent& a, const ClipEvent& b) { return a.time_s < b.time_s; });
}

Result<Clip> ClipBuilder::build() {
  if (times_.empty()) return wrong("the take has no snapshot");
  if (const Status fit = check_subjects(); !fit) return fit.error();
  const double period = period_s();
  const std::vector<std::int64_t> frame_of = frames_at(period);
  const std::int64_t last = *std::max_element(frame_of.begin(), frame_of.end());
  const auto used = std::count_if(frame_of.begin(), frame_of.end(), [](std::int64_t frame) { return frame >= 0; });
  if (last > kFramesAlwaysAllowed + kMaxFramesPerSnapshot * static_cast<std::int64_t>(times_.size())) {
    return wrong(fmt::format("{} snapshots span {} frames of {:.3g} ms: the times are wrong", times_.size(), last,
                             1e3 * period));
  }
  Clip clip;
  clip.name = name_;
  clip.producer = producer_;
  clip.rate = rate_for(period, last);
  clip.frames = static_cast<std::size_t>(last) + 1;
  report_ = {times_.size(), clip.frames - static_cast<std::size_t>(used),
             times_.size() - static_cast<std::size_t>(used), 0};
  if (utc_minus_host_ns_) clip.first_utc_ns = to_ns(times_.front()) + *utc_minus_host_ns_;
  if (timecode_ && timecode_->frames_per_second > 0) {
    clip.first_timecode = timecode_;
    clip.first_timecode = timecode_at(clip, to_s(times_.front() - times_[timecode_at_]));
  }
  for (Track& track : tracks_) {
    const MarkerSet& set = track.rows.subject.marker_set;
    ClipSubject& subject = clip.subjects.emplace_back();
    subject.markers = spread(track.rows.markers, set.markers.size(), frame_of, clip.frames);
    subject.bones = spread(track.rows.bones, set.skeleton.bones.size(), frame_of, clip.frames);
    subject.subject = std::move(track.rows.subject);
  }
  add_events(clip, period, frame_of);
  return clip;
}

}  // namespace mocap::exports
