#pragma once

#include <cstdint>
#include <map>

#include "mocap/v1/snapshot.pb.h"

namespace mocap::join {

/// Gives the tracks of all chunks ids of the joined take. The ids of the first chunk remain.
class TrackIds {
 public:
  /// Replaces the ids of a snapshot of the current chunk.
  void renumber(v1::Snapshot& snapshot);

  /// The next chunk becomes the current one. Each of its tracks gets a new id.
  void go_over();
  /// Tracks of the current chunk that are less than 10 mm (offline/same_subject) from a track of the chunk before get
  /// the id of that track. After `go_over`. `earlier`: a set of the chunk before, renumbered; `later`: the same set in
  /// the current chunk.
  void go_on_from(const v1::Snapshot& earlier, const v1::Snapshot& later);

 private:
  std::uint32_t id_of(std::uint32_t track);

  bool is_first_ = true;
  std::map<std::uint32_t, std::uint32_t> ids_;  // plus one, by id in the current chunk plus one
  std::uint32_t last_ = 0;                      // the largest that was given, plus one
};

}  // namespace mocap::join
