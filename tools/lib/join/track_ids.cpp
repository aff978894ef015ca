#include "lib/join/track_ids.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>
#include <vector>

#include "lib/offline/same_subject.h"

namespace mocap::join {
namespace {

struct Track {
  std::uint32_t id;  // plus one
  double x_m, y_m, z_m;
};

template <class Markers>
void add_tracks(const Markers& markers, std::vector<Track>& into) {
  const int count = std::min(markers.track_ids_plus_one_size(), markers.positions_m_size() / 3);
  for (int m = 0; m < count; ++m) {
    if (markers.track_ids_plus_one(m) == 0) continue;
    into.push_back({markers.track_ids_plus_one(m), markers.positions_m(3 * m), markers.positions_m(3 * m + 1),
                    markers.positions_m(3 * m + 2)});
  }
}

std::vector<Track> tracks_of(const v1::Snapshot& snapshot) {
  std::vector<Track> tracks;
  for (const v1::SubjectState& subject : snapshot.subjects()) add_tracks(subject.markers(), tracks);
  add_tracks(snapshot.unlabelled(), tracks);
  return tracks;
}

}  // namespace

void TrackIds::renumber(v1::Snapshot& snapshot) {
  const auto renumber_all = [&](auto& ids) {
    for (std::uint32_t& id : ids) id = id_of(id);
  };
  for (v1::SubjectState& subject : *snapshot.mutable_subjects()) {
    if (subject.has_markers()) renumber_all(*subject.mutable_markers()->mutable_track_ids_plus_one());
  }
  if (snapshot.has_unlabelled()) renumber_all(*snapshot.mutable_unlabelled()->mutable_track_ids_plus_one());
}

std::uint32_t TrackIds::id_of(std::uint32_t track) {
  if (track == 0) return 0;
  if (is_first_) {
    last_ = std::max(last_, track);
    return track;
  }
  const auto [known, is_new] = ids_.try_emplace(track, 0);
  if (is_new) known->second = ++last_;
  return known->second;
}

void TrackIds::go_over() {
  is_first_ = false;
  ids_.clear();
}

void TrackIds::go_on_from(const v1::Snapshot& earlier, const v1::Snapshot& later) {
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> near;  // distance, id in the next chunk, id so far
  const std::vector<Track> so_far = tracks_of(earlier);
  for (const Track& next : tracks_of(later)) {
    for (const Track& track : so_far) {
      const double distance_m = std::hypot(next.x_m - track.x_m, next.y_m - track.y_m, next.z_m - track.z_m);
      if (distance_m < offline::kSameMarker_m) near.emplace_back(distance_m, next.id, track.id);
    }
  }
  std::ranges::sort(near);
  std::set<std::uint32_t> taken;
  for (const auto& [distance_m, next, so_far_id] : near) {
    if (!ids_.contains(next) && taken.insert(so_far_id).second) ids_.emplace(next, so_far_id);
  }
}

}  // namespace mocap::join
