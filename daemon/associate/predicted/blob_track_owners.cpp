#include "associate/predicted/blob_track_owners.h"

#include <algorithm>

#include "base/expects.h"

namespace mocap::associate {
namespace {

// A moment, in images: as long as blobs that cross hide each other.
constexpr std::uint32_t kMaxBearingAge_images = 24;
constexpr std::size_t kMaxRecent = 64;  // of a camera

}  // namespace

BlobTrackOwners::BlobTrackOwners(std::size_t camera_count)
    : entries_(camera_count * kTableSize), images_(camera_count, 0), recent_(camera_count) {
  for (std::vector<RecentBearing>& recent : recent_) recent.reserve(kMaxRecent);
  recent_bearing_only_.reserve(kMaxRecent);
  track_index_.reserve(kMaxMarkers);
  track_of_.reserve(kMaxMarkers);
  label_of_.reserve(kMaxMarkers);
}

void BlobTrackOwners::set_predictions(const Expected& expected) {
  track_index_.clear();
  track_of_.clear();
  label_of_.clear();
  for (std::uint32_t m = 0; m < expected.markers.size(); ++m) {
    const TrackId track = expected.markers.data()[m].track;
    track_of_.push_back(track);
    label_of_.push_back(expected.markers.data()[m].label);
    if (track.names_something()) track_index_.push_back({track, m});
  }
  if (!std::ranges::is_sorted(track_index_, {}, &TrackIndexEntry::track))
    std::ranges::sort(track_index_, {}, &TrackIndexEntry::track);
}

void BlobTrackOwners::note_bearing_only(CameraId camera, std::uint32_t marker) {
  const Label label = label_of_[marker];
  std::vector<RecentBearing>& recent = recent_[camera.value];
  if (!label.names_something()) return;
  const auto existing = std::ranges::find(recent, label, &RecentBearing::label);
  if (existing != recent.end()) {
    existing->image = images_[camera.value];
  } else if (recent.size() < recent.capacity()) {
    recent.push_back({label, images_[camera.value]});
  }
}

std::span<const std::uint32_t> BlobTrackOwners::recent_bearing_only(CameraId camera) {
  const std::uint32_t image = images_[camera.value];
  std::erase_if(recent_[camera.value],
                [&](const RecentBearing& one) { return image - one.image > kMaxBearingAge_images; });
  recent_bearing_only_.clear();
  for (const RecentBearing& one : recent_[camera.value]) {
    const std::uint32_t marker = marker_of(one.label);
    if (marker != kUnpredicted) recent_bearing_only_.push_back(marker);
  }
  return recent_bearing_only_;
}

std::uint32_t BlobTrackOwners::marker_of(Label label) const {
  const auto named = std::ranges::find(label_of_, label);
  if (!label.names_something() || named == label_of_.end()) return kUnpredicted;
  return static_cast<std::uint32_t>(named - label_of_.begin());
}

std::uint32_t BlobTrackOwners::predicted_marker(CameraId camera, BlobTrackId blob) {
  if (!blob.names_something()) return kUnknown;
  Entry& entry = entries_[camera.value * kTableSize + blob.value % kTableSize];
  if (entry.blob != blob) return kUnknown;
  const bool is_continuous = entry.image + 1 == images_[camera.value];
  entry.image = images_[camera.value];
  if (!is_continuous) entry.sets = 0;
  if (entry.sets < kConfirmSets) return kUnknown;
  const auto found = std::ranges::lower_bound(track_index_, entry.owner, {}, &TrackIndexEntry::track);
  if (found != track_index_.end() && found->track == entry.owner) return found->marker;
  return marker_of(entry.label);
}

void BlobTrackOwners::associate(CameraId camera, BlobTrackId blob, std::uint32_t marker) {
  const TrackId owner = track_of_[marker];
  const Label label = label_of_[marker];
  if (!blob.names_something() || !(owner.names_something() || label.names_something())) return;
  Entry& entry = entries_[camera.value * kTableSize + blob.value % kTableSize];
  const bool same_owner = owner.names_something() && entry.owner == owner;
  const bool same_label = label.names_something() && entry.label == label;
  if (entry.blob != blob || !(same_owner || same_label)) entry = {blob, owner, label, 0, images_[camera.value]};
  entry.owner = owner;
  entry.label = label;
  entry.sets = std::min(entry.sets + 1, kConfirmSets);
}

}  // namespace mocap::associate
