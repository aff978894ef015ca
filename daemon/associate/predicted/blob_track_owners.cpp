#include "associate/predicted/blob_track_owners.h"

#include <algorithm>

#include "base/expects.h"

namespace mocap::associate {
namespace {

// A moment, in images: as long as blobs that cross hide each other.
constexpr std::uint32_t kMoment = 24;
constexpr std::size_t kNames = 64;  // of a camera

}  // namespace

BlobOwners::BlobOwners(std::size_t camera_count)
    : entries_(camera_count * kRemembered), images_(camera_count, 0), alone_(camera_count) {
  for (std::vector<Alone>& names : alone_) names.reserve(kNames);
  seen_alone_.reserve(kNames);
  known_.reserve(kMaxMarkers);
  track_of_.reserve(kMaxMarkers);
  name_of_.reserve(kMaxMarkers);
}

void BlobOwners::expect(const Expected& expected) {
  known_.clear();
  track_of_.clear();
  name_of_.clear();
  for (std::uint32_t m = 0; m < expected.markers.size(); ++m) {
    const TrackId track = expected.markers.data()[m].track;
    track_of_.push_back(track);
    name_of_.push_back(expected.markers.data()[m].label);
    if (track.names_something()) known_.push_back({track, m});
  }
  if (!std::ranges::is_sorted(known_, {}, &Known::track)) std::ranges::sort(known_, {}, &Known::track);
}

void BlobOwners::see_alone(CameraId camera, std::uint32_t marker) {
  const Label name = name_of_[marker];
  std::vector<Alone>& names = alone_[camera.value];
  if (!name.names_something()) return;
  const auto known = std::ranges::find(names, name, &Alone::name);
  if (known != names.end()) {
    known->image = images_[camera.value];
  } else if (names.size() < names.capacity()) {
    names.push_back({name, images_[camera.value]});
  }
}

std::span<const std::uint32_t> BlobOwners::seen_alone(CameraId camera) {
  const std::uint32_t image = images_[camera.value];
  std::erase_if(alone_[camera.value], [&](const Alone& one) { return image - one.image > kMoment; });
  seen_alone_.clear();
  for (const Alone& one : alone_[camera.value]) {
    const std::uint32_t marker = marker_of(one.name);
    if (marker != kStranger) seen_alone_.push_back(marker);
  }
  return seen_alone_;
}

std::uint32_t BlobOwners::marker_of(Label name) const {
  const auto named = std::ranges::find(name_of_, name);
  if (!name.names_something() || named == name_of_.end()) return kStranger;
  return static_cast<std::uint32_t>(named - name_of_.begin());
}

std::uint32_t BlobOwners::owner_of(CameraId camera, BlobTrackId blob) {
  if (!blob.names_something()) return kNobody;
  Entry& entry = entries_[camera.value * kRemembered + blob.value % kRemembered];
  if (entry.blob != blob) return kNobody;
  const bool went_on = entry.image + 1 == images_[camera.value];
  entry.image = images_[camera.value];
  if (!went_on) entry.sets = 0;
  if (entry.sets < kBelieved) return kNobody;
  const auto found = std::ranges::lower_bound(known_, entry.owner, {}, &Known::track);
  if (found != known_.end() && found->track == entry.owner) return found->marker;
  return marker_of(entry.name);
}

void BlobOwners::learn(CameraId camera, BlobTrackId blob, std::uint32_t marker) {
  const TrackId owner = track_of_[marker];
  const Label name = name_of_[marker];
  if (!blob.names_something() || !(owner.names_something() || name.names_something())) return;
  Entry& entry = entries_[camera.value * kRemembered + blob.value % kRemembered];
  const bool same_owner = owner.names_something() && entry.owner == owner;
  const bool same_name = name.names_something() && entry.name == name;
  if (entry.blob != blob || !(same_owner || same_name)) entry = {blob, owner, name, 0, images_[camera.value]};
  entry.owner = owner;
  entry.name = name;
  entry.sets = std::min(entry.sets + 1, kBelieved);
}

}  // namespace mocap::associate
