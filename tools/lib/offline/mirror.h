#pragma once

#include <cstdint>
#include <vector>

#include "base/time.h"
#include "model/blob.h"
#include "model/sighting.h"
#include "model/snapshot.h"

namespace mocap::offline {

/// A set that owns its images.
struct OwnedSet {
  std::uint64_t number = 0;
  std::uint32_t expected_views = 0;
  std::vector<BlobFrame> images;

  /// Borrows the images. Precondition: there are images.
  FrameSet set() const;
};

/// Turns time around: what happened at t happens at first + last - t, so that the last set comes first. Numbers of sets
/// and images count upwards again.
class Mirror {
 public:
  Mirror(Timestamp first, Timestamp last) : sum_(to_ns(first) + to_ns(last)) {}

  Timestamp mirrored(Timestamp at) const { return from_ns(sum_ - to_ns(at)); }
  OwnedSet mirrored(OwnedSet set) const;

  /// The subjects of a snapshot of a mirrored set, as they are in forward time: velocities are reversed.
  static void unmirror(Poses& poses);

 private:
  std::int64_t sum_;
};

}  // namespace mocap::offline
