#include "take/recorder/take_intake.h"

#include <algorithm>

#include "take/recorder/lead_in.h"
#include "wire/codec/camera_blobs.h"
#include "wire/codec/encode.h"

namespace mocap::take {
namespace {

bool same_cameras(const Description& one, const Description& other) {
  return std::ranges::equal(one.cameras, other.cameras, {}, &CameraModel::name, &CameraModel::name);
}

}  // namespace

TakeIntake::TakeIntake(const TakesSettings& settings, Duration least_kept, const Description& description,
                       std::vector<TakeFile> files)
    : keeps_blobs_(settings.blobs),
      before_(settings.before),
      buffer_(settings.memory_mb * 1'000'000, std::max(settings.before, least_kept) + kLongestLead),
      description_(description),
      descriptions_{{Timestamp::min(), description}},
      files_(std::move(files)) {
  events_.update(description, host_now());
}

void TakeIntake::keep(const BlobFrame& frame) {
  if (!keeps_blobs_) return;
  wire::encode(frame, blobs_);
  blobs_.SerializeToString(&bytes_);
  buffer_.add({BufferedKind::Blobs, frame.camera.value, frame.exposed_at, bytes_});
}

void TakeIntake::keep(const Snapshot& snapshot) {
  const Timestamp at = snapshot.instants.exposed_at;
  if (first_set_.load(std::memory_order_relaxed) == kNoSet) first_set_.store(snapshot.number);
  if (description_changed_) add_description(at);
  wire::encode(snapshot, snapshot_);
  if (snapshot.delivering_cameras > 0) snapshot_.set_delivering_cameras(snapshot.delivering_cameras);
  snapshot_.SerializeToString(&bytes_);
  buffer_.add({BufferedKind::Snapshot, 0, at, bytes_});
  events_.update(snapshot);
  add_events();
}

void TakeIntake::keep(const Health& health) {
  wire::encode(health, health_);
  health_.SerializeToString(&bytes_);
  buffer_.add({BufferedKind::Health, 0, health.at, bytes_});
  events_.update(health);
  add_events();
}

void TakeIntake::keep(const Belief& belief) {
  if (!keeps_blobs_) return;
  belief_.set_after_set(belief.after_set);
  const auto state = belief.bytes();
  belief_.set_state(std::string(compressor_.compress({reinterpret_cast<const char*>(state.data()), state.size()})));
  belief_.set_state_size(state.size());
  belief_.SerializeToString(&bytes_);
  buffer_.add({BufferedKind::Belief, 0, belief.at, bytes_});
}

void TakeIntake::count_dropped(std::uint64_t images, std::uint64_t sets) {
  dropped_images_.fetch_add(images, std::memory_order_relaxed);
  dropped_sets_.fetch_add(sets, std::memory_order_relaxed);
}

TakeIntake::Dropped TakeIntake::dropped() const noexcept {
  return {dropped_images_.load(std::memory_order_relaxed), dropped_sets_.load(std::memory_order_relaxed)};
}

void TakeIntake::learn(const SubjectFit& fit) {
  description_ = with_fit(std::move(description_), fit);
  description_changed_ = true;
}

void TakeIntake::describe(const Description& description, std::vector<TakeFile> files, Timestamp now) {
  const bool same = same_cameras(description, description_);
  {
    const std::lock_guard lock(mutex_);
    files_ = std::move(files);
  }
  description_ = description;
  description_changed_ = true;
  if (same) return;
  buffer_.add({BufferedKind::Break, 0, now, {}});
  {
    const std::lock_guard lock(mutex_);
    descriptions_.assign(1, {now, description_});  // never empty: the disk thread reads it
  }
  add_description(now);
}

Description TakeIntake::description_at(Timestamp at) const {
  const std::lock_guard lock(mutex_);
  Description found = descriptions_.front().second;
  for (const auto& [since, description] : descriptions_) {
    if (since <= at) found = description;
  }
  return found;
}

std::vector<TakeFile> TakeIntake::files() const {
  const std::lock_guard lock(mutex_);
  return files_;
}

std::optional<std::uint64_t> TakeIntake::first_set() const noexcept {
  const std::uint64_t first = first_set_.load();
  return first == kNoSet ? std::nullopt : std::optional(first);
}

void TakeIntake::add_description(Timestamp at) {
  description_changed_ = false;
  wire::encode(description_).SerializeToString(&description_bytes_);
  buffer_.add({BufferedKind::Description, 0, at, description_bytes_});
  events_.update(description_, at);
  const std::lock_guard lock(mutex_);
  descriptions_.emplace_back(at, description_);
  // The last one before the oldest message stays.
  while (descriptions_.size() > 1 && descriptions_[1].first < at - before_) descriptions_.pop_front();
}

void TakeIntake::add_events() {
  while (!events_.unsent().empty()) {
    const v1::Event& event = events_.unsent().front();
    event.SerializeToString(&bytes_);
    buffer_.add({BufferedKind::Event, 0, from_ns(event.at_ns()), bytes_});
    events_.remove_oldest();
  }
}

}  // namespace mocap::take
