#include "lib/retrack/recorded_sets.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "synchronise/frame_aligner.h"

namespace mocap::retrack {
namespace {

// Images that wait for a set: those of a camera that runs ahead of the others, and those that were in no set.
constexpr std::size_t kMostWaiting = 64;
// Snapshots that wait for their images: those of the longest offset at 1000 Hz.
constexpr std::size_t kMostSnapshots = 1000;
// A larger offset from the mean of a set is damage.
constexpr std::int64_t kMostSkew_ns = std::chrono::nanoseconds(std::chrono::seconds(1)).count();

Timestamp exposure_of(const v1::Views& views, int view, Timestamp mean) {
  return mean + Duration{std::clamp(views.skews_ns(view), -kMostSkew_ns, kMostSkew_ns)};
}

bool has_view(const TakeSet& set, CameraId camera) {
  return std::ranges::any_of(set.frames.views, [&](const BlobFrame* view) { return view->camera == camera; });
}

bool has_whole_columns(const v1::Views& views) {
  const int count = views.cameras_size();
  return views.frame_numbers_size() == count && views.skews_ns_size() == count &&
         count <= static_cast<int>(kMaxCameras);
}

}  // namespace

RecordedSets::RecordedSets(std::vector<CameraId> camera_ids, std::uint32_t camera_count)
    : camera_ids_(std::move(camera_ids)),
      camera_count_(camera_count),
      all_cameras_(camera_ids_.size() == camera_count &&
                   std::ranges::all_of(camera_ids_, [](CameraId id) { return id.names_something(); })),
      frames_(camera_count) {}

void RecordedSets::add(const BlobFrame& frame) {
  std::deque<BlobFrame>& waiting = frames_[frame.camera.value];
  if (waiting.size() == kMostWaiting) waiting.pop_front();
  waiting.push_back(frame);
}

void RecordedSets::add(RecordedSnapshot snapshot) { snapshots_.push_back(std::move(snapshot)); }

std::optional<TakeSet> RecordedSets::next(Timestamp read_up_to) {
  while (!snapshots_.empty() &&
         (last_exposure(snapshots_.front().message) < read_up_to || snapshots_.size() > kMostSnapshots)) {
    TakeSet set;
    set.recorded = std::move(snapshots_.front());
    snapshots_.pop_front();
    const v1::Snapshot& recorded = set.recorded->message;
    if (!has_whole_columns(recorded.views())) continue;
    const Timestamp mean = from_ns(recorded.instants().exposed_at_ns());
    set.frames.number = recorded.number();
    set.frames.expected_views = expected_views(recorded);
    for (int view = 0; view < recorded.views().cameras_size(); ++view) add_view(set, recorded.views(), view, mean);
    if (set.frames.views.empty()) continue;
    std::ranges::sort(set.frames.views, {}, [](const BlobFrame* view) { return view->camera.value; });
    set.frames.exposed_at = synchronise::mean_exposure(set.frames);
    return set;
  }
  return std::nullopt;
}

void RecordedSets::add_view(TakeSet& set, const v1::Views& views, int view, Timestamp mean) {
  if (views.cameras(view) >= camera_ids_.size()) return;
  const CameraId camera = camera_ids_[views.cameras(view)];
  if (!camera.names_something() || has_view(set, camera)) return;
  const BlobFrame* frame = find(camera, views.frame_numbers(view), exposure_of(views, view, mean));
  if (frame == nullptr) {
    ++set.missing_views;
  } else {
    set.frames.views.push_back(frame);
  }
}

// Removes the images that were exposed before the wanted one.
const BlobFrame* RecordedSets::find(CameraId camera, std::uint64_t number, Timestamp exposed_at) {
  std::deque<BlobFrame>& waiting = frames_[camera.value];
  while (!waiting.empty() && waiting.front().exposed_at < exposed_at) waiting.pop_front();
  if (waiting.empty() || waiting.front().exposed_at != exposed_at || waiting.front().number != number) return nullptr;
  return &waiting.front();
}

Timestamp RecordedSets::last_exposure(const v1::Snapshot& snapshot) {
  const Timestamp mean = from_ns(snapshot.instants().exposed_at_ns());
  Timestamp last = mean;
  for (int view = 0; view < snapshot.views().skews_ns_size(); ++view) {
    last = std::max(last, exposure_of(snapshot.views(), view, mean));
  }
  return last;
}

// A take of an older version does not have the number of cameras that delivered images.
std::uint32_t RecordedSets::expected_views(const v1::Snapshot& snapshot) const {
  if (!snapshot.has_delivering_cameras() || !all_cameras_) return camera_count_;
  return std::min(snapshot.delivering_cameras(), camera_count_);
}

}  // namespace mocap::retrack
