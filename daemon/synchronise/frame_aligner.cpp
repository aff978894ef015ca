#include "synchronise/frame_aligner.h"

#include <algorithm>

#include "base/expects.h"

namespace mocap::synchronise {
namespace {

// Of a camera's period: its next frame is not due sooner after its last.
constexpr double kDueAfter = 0.6;

// One or two images are lost now and then; who let patience end so often has stopped.
constexpr std::size_t kStopped = 4;

// When a frame was here: frames from files may lack some of the instants.
Timestamp arrival_of(const BlobFrame& frame) {
  return std::max({frame.exposed_at, frame.received_at, frame.detected_at});
}

}  // namespace

FrameAligner::FrameAligner(AlignSettings settings, std::size_t camera_count)
    : settings_(settings), cameras_(camera_count), watch_(settings.window, camera_count) {
  MOCAP_EXPECTS(camera_count >= 1 && camera_count <= kMaxCameras);
  MOCAP_EXPECTS(settings.window.count() >= 0 && settings.patience.count() >= 0);
}

const FrameAligner::Waiting& FrameAligner::waiting(CameraId camera) const {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  return cameras_[camera.value];
}

FrameAligner::Waiting& FrameAligner::waiting(CameraId camera) {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  return cameras_[camera.value];
}

bool FrameAligner::has_room(CameraId camera) const { return waiting(camera).size < kPending; }

bool FrameAligner::is_expected(CameraId camera) const { return waiting(camera).expected; }

const CameraSkew& FrameAligner::skew(CameraId camera) const { return waiting(camera).skew; }

std::uint32_t FrameAligner::expected_cameras() const {
  return static_cast<std::uint32_t>(std::ranges::count_if(cameras_, &Waiting::expected));
}

void FrameAligner::finish(CameraId camera) { waiting(camera).expected = false; }

void FrameAligner::rejoin(CameraId camera) {
  Waiting& own = waiting(camera);
  own.expected = true;
  own.missed_in_row = 0;
  own.last = Timestamp::min();
  own.repeated_in_row = 0;
  while (own.size > 0) own.pop();
  watch_.forget(camera);
}

void FrameAligner::add(const BlobFrame& frame) {
  Waiting& own = waiting(frame.camera);
  if (frame.exposed_at <= own.last) {
    ++counts_.repeated;
    if (++own.repeated_in_row < kPending) return;
    while (own.size > 0) own.pop();
  }
  own.repeated_in_row = 0;
  own.last = frame.exposed_at;
  watch_.see(frame.camera, frame.exposed_at);
  if (would_be_awaited(frame)) own.missed_in_row = 0;
  if (frame.exposed_at <= passed_) {
    ++counts_.late;
  } else if (own.size == kPending) {
    ++counts_.overflow;
  } else {
    if (own.size == 0) own.first = 0;  // the slot that is in the cache
    own.ring[(own.first + own.size) % kPending] = frame;
    ++own.size;
  }
}

bool FrameAligner::ready(Timestamp now) const {
  const auto first = first_exposure();
  if (!first) return false;
  const bool live = now != Timestamp::min();
  const Timestamp end = *first + settings_.window;
  if (nobody_is_awaited(end, live)) return true;
  const auto is_full = [](const Waiting& own) { return own.size == kPending; };
  return live && (now >= *first_arrival(end) + settings_.patience || std::ranges::any_of(cameras_, is_full));
}

std::optional<FrameSet> FrameAligner::take(Timestamp now) {
  if (!ready(now)) return std::nullopt;
  return gather(*first_exposure() + settings_.window);
}

std::optional<Timestamp> FrameAligner::patience_ends() const {
  const auto first = first_exposure();
  if (!first) return std::nullopt;
  return *first_arrival(*first + settings_.window) + settings_.patience;
}

std::optional<Timestamp> FrameAligner::first_exposure() const {
  std::optional<Timestamp> first;
  for (const Waiting& own : cameras_) {
    if (own.size > 0 && (!first || own.front().exposed_at < *first)) first = own.front().exposed_at;
  }
  return first;
}

// Whether a camera may still bring a frame for the set, by the pace of its frames.
bool FrameAligner::is_due(std::size_t camera, Timestamp end) const {
  const CameraTiming& timing = watch_.timing(CameraId{static_cast<std::uint32_t>(camera)});
  if (!timing.told || timing.rate_hz <= 0.0) return true;
  return cameras_[camera].last + from_s(kDueAfter / timing.rate_hz) <= end;
}

// Whether its set would have waited for it, had it known of it.
bool FrameAligner::would_be_awaited(const BlobFrame& frame) const {
  return frame.exposed_at > passed_ || arrival_of(frame) - frame.exposed_at - first_delay_ < settings_.patience;
}

// Whether no expected camera can still bring a frame for the set that waits: each has one that waits, in it or later.
bool FrameAligner::nobody_is_awaited(Timestamp end, bool live) const {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const Waiting& own = cameras_[c];
    if (!own.expected || own.size > 0) continue;
    if (!live || (own.missed_in_row < kStopped && is_due(c, end))) return false;
  }
  return true;
}

// Of the frames that the set would hold now.
std::optional<Timestamp> FrameAligner::first_arrival(Timestamp end) const {
  std::optional<Timestamp> first;
  for (const Waiting& own : cameras_) {
    if (own.size == 0 || own.front().exposed_at > end) continue;
    const Timestamp arrival = arrival_of(own.front());
    if (!first || arrival < *first) first = arrival;
  }
  return first;
}

FrameSet FrameAligner::gather(Timestamp end) {
  FrameSet set;
  set.number = counts_.sets++;
  set.expected_views = expected_cameras();
  std::uint32_t expected_seen = 0;
  Duration after_first{0};
  first_delay_ = *first_arrival(end) - *first_exposure();
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Waiting& own = cameras_[c];
    if (own.size == 0 && is_due(c, end)) ++own.missed_in_row;
    if (own.size == 0 || own.front().exposed_at > end) continue;
    set.views.push_back(&own.front());
    after_first += own.front().exposed_at - set.views.front()->exposed_at;
    expected_seen += own.expected ? 1 : 0;
    own.pop();
    // A camera with two frames in one window is faster than the window allows: the second has no set of its own.
    while (own.size > 0 && own.front().exposed_at <= end) {
      own.pop();
      ++counts_.late;
    }
  }
  set.exposed_at = set.views.front()->exposed_at + after_first / static_cast<Duration::rep>(set.views.size());
  if (expected_seen == set.expected_views) ++counts_.complete;
  passed_ = end;
  learn_skew(set);
  return set;
}

void FrameAligner::learn_skew(const FrameSet& set) {
  if (set.views.size() < 2) return;
  for (const BlobFrame* view : set.views) {
    CameraSkew& skew = waiting(view->camera).skew;
    const Duration off = view->exposed_at - set.exposed_at;
    ++skew.sets;
    skew.sum += off;
    skew.largest = std::max(skew.largest, Duration{std::abs(off.count())});
  }
}

}  // namespace mocap::synchronise
