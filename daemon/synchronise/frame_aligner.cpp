#include "synchronise/frame_aligner.h"

#include <algorithm>

#include "base/expects.h"

namespace mocap::synchronise {
namespace {

// A camera's next frame is due this many periods after its last frame.
constexpr double kDueAfterPeriods = 0.6;

// Single lost images are normal; a camera that let patience run out for this many sets in a row has stopped.
constexpr std::size_t kStoppedAfterSets = 4;

// Returns when a frame arrived. Frames from files may lack some of the instants.
Timestamp arrival_of(const BlobFrame& frame) {
  return std::max({frame.exposed_at, frame.received_at, frame.detected_at});
}

}  // namespace

Timestamp mean_exposure(const FrameSet& set) {
  const Timestamp first = set.views.front()->exposed_at;
  Duration after_first{0};
  for (const BlobFrame* view : set.views) after_first += view->exposed_at - first;
  return first + after_first / static_cast<Duration::rep>(set.views.size());
}

FrameAligner::FrameAligner(AlignSettings settings, std::size_t camera_count)
    : settings_(settings), cameras_(camera_count), watch_(settings.window, camera_count) {
  MOCAP_EXPECTS(camera_count >= 1 && camera_count <= kMaxCameras);
  MOCAP_EXPECTS(settings.window.count() >= 0 && settings.patience.count() >= 0);
}

const FrameAligner::CameraQueue& FrameAligner::queue_of(CameraId camera) const {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  return cameras_[camera.value];
}

FrameAligner::CameraQueue& FrameAligner::queue_of(CameraId camera) {
  MOCAP_EXPECTS(camera.value < cameras_.size());
  return cameras_[camera.value];
}

bool FrameAligner::has_room(CameraId camera) const { return queue_of(camera).size < kPending; }

bool FrameAligner::is_expected(CameraId camera) const { return queue_of(camera).expected; }

const CameraSkew& FrameAligner::skew(CameraId camera) const { return queue_of(camera).skew; }

std::uint32_t FrameAligner::expected_cameras() const {
  return static_cast<std::uint32_t>(std::ranges::count_if(cameras_, &CameraQueue::expected));
}

void FrameAligner::finish(CameraId camera) { queue_of(camera).expected = false; }

void FrameAligner::rejoin(CameraId camera) {
  CameraQueue& queue = queue_of(camera);
  queue.expected = true;
  queue.missed_in_row = 0;
  queue.last = Timestamp::min();
  queue.repeated_in_row = 0;
  clear(queue);
  watch_.forget(camera);
}

void FrameAligner::clear(CameraQueue& queue) {
  counts_.cleared += queue.size;
  while (queue.size > 0) queue.pop();
}

void FrameAligner::add(const BlobFrame& frame) {
  CameraQueue& queue = queue_of(frame.camera);
  if (frame.exposed_at <= queue.last) {
    if (++queue.repeated_in_row < kPending) {
      ++counts_.repeated;
      return;
    }
    clear(queue);
  }
  queue.repeated_in_row = 0;
  queue.last = frame.exposed_at;
  watch_.see(frame.camera, frame.exposed_at);
  if (is_in_time(frame)) queue.missed_in_row = 0;
  if (frame.exposed_at <= last_set_end_) {
    ++counts_.late;
  } else if (queue.size == kPending) {
    ++counts_.overflow;
  } else {
    if (queue.size == 0) queue.first = 0;  // reuses the slot that is in the CPU cache
    queue.ring[(queue.first + queue.size) % kPending] = frame;
    ++queue.size;
  }
}

bool FrameAligner::ready(Timestamp now) const {
  const auto first = first_exposure();
  return first && is_ready_from(*first, now);
}

// Returns whether the set that begins at `first` could be taken once the sets before are taken.
bool FrameAligner::is_ready_from(Timestamp first, Timestamp now) const {
  const bool live = now != Timestamp::min();
  const Timestamp end = first + settings_.window;
  if (is_awaiting_nobody(first, end, live)) return true;
  const auto is_full = [](const CameraQueue& queue) { return queue.size == kPending; };
  return live && (now >= *first_arrival(end) + settings_.patience || std::ranges::any_of(cameras_, is_full));
}

std::optional<FrameSet> FrameAligner::take(Timestamp now) {
  if (!ready(now)) return std::nullopt;
  return gather(*first_exposure() + settings_.window);
}

bool FrameAligner::is_superseded(const FrameSet& set, Timestamp now) const {
  std::optional<Timestamp> first;
  for (const BlobFrame* view : set.views) {
    const CameraQueue& queue = queue_of(view->camera);
    if (queue.size == 0) return false;
    first = std::min(first.value_or(queue.front().exposed_at), queue.front().exposed_at);
  }
  return first && is_ready_from(*first, now);
}

std::optional<Timestamp> FrameAligner::patience_ends() const {
  const auto first = first_exposure();
  if (!first) return std::nullopt;
  return *first_arrival(*first + settings_.window) + settings_.patience;
}

std::optional<Timestamp> FrameAligner::first_exposure() const {
  std::optional<Timestamp> first;
  for (const CameraQueue& queue : cameras_) {
    if (queue.size > 0 && (!first || queue.front().exposed_at < *first)) first = queue.front().exposed_at;
  }
  return first;
}

// Returns whether, by its frame rate, a camera's next frame may belong to the set that ends at `end`.
bool FrameAligner::is_due(std::size_t camera, Timestamp end) const {
  const CameraTiming& timing = watch_.timing(CameraId{static_cast<std::uint32_t>(camera)});
  if (!timing.is_known || timing.rate_hz <= 0.0) return true;
  return cameras_[camera].last + from_s(kDueAfterPeriods / timing.rate_hz) <= end;
}

// Returns whether the frame arrived within the patience of its set.
bool FrameAligner::is_in_time(const BlobFrame& frame) const {
  return frame.exposed_at > last_set_end_ || arrival_of(frame) - frame.exposed_at - first_delay_ < settings_.patience;
}

// Returns whether every expected camera has a waiting frame, in the set or after the set, or is not waited for.
bool FrameAligner::is_awaiting_nobody(Timestamp first, Timestamp end, bool live) const {
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const CameraQueue& queue = cameras_[c];
    if (!queue.expected || (queue.size > 0 && queue.last >= first)) continue;
    if (!live || (queue.missed_in_row < kStoppedAfterSets && is_due(c, end))) return false;
  }
  return true;
}

// Returns the earliest arrival among the frames of the set that ends at `end`.
std::optional<Timestamp> FrameAligner::first_arrival(Timestamp end) const {
  std::optional<Timestamp> first;
  for (const CameraQueue& queue : cameras_) {
    if (queue.size == 0 || queue.front().exposed_at > end) continue;
    const Timestamp arrival = arrival_of(queue.front());
    if (!first || arrival < *first) first = arrival;
  }
  return first;
}

FrameSet FrameAligner::gather(Timestamp end) {
  FrameSet set;
  set.number = counts_.sets++;
  set.expected_views = expected_cameras();
  std::uint32_t expected_seen = 0;
  first_delay_ = *first_arrival(end) - *first_exposure();
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    CameraQueue& queue = cameras_[c];
    if (queue.size == 0 && is_due(c, end)) ++queue.missed_in_row;
    if (queue.size == 0 || queue.front().exposed_at > end) continue;
    set.views.push_back(&queue.front());
    expected_seen += queue.expected ? 1 : 0;
    queue.pop();
    // A second frame of one camera within the window has no set: the frame period is shorter than the window.
    while (queue.size > 0 && queue.front().exposed_at <= end) {
      queue.pop();
      ++counts_.late;
    }
  }
  set.exposed_at = mean_exposure(set);
  if (expected_seen == set.expected_views) ++counts_.complete;
  last_set_end_ = end;
  learn_skew(set);
  return set;
}

void FrameAligner::learn_skew(const FrameSet& set) {
  if (set.views.size() < 2) return;
  for (const BlobFrame* view : set.views) {
    CameraSkew& skew = queue_of(view->camera).skew;
    const Duration off = view->exposed_at - set.exposed_at;
    ++skew.sets;
    skew.sum += off;
    skew.largest = std::max(skew.largest, Duration{std::abs(off.count())});
  }
}

}  // namespace mocap::synchronise
