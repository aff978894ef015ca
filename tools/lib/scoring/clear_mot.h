#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "geometry/assignment.h"

namespace mocap::scoring {

/// An object of the truth and a track that may be matched, with the distance between them.
struct MotPair {
  std::uint32_t object = 0;  ///< index in the frame
  std::uint32_t track = 0;   ///< index in the frame
  double distance = 0.0;
};

/// CLEAR-MOT, counted frame by frame.
/// A pair that was matched in the previous frame stays matched while it is allowed, even if another pair is closer. The
/// other objects and tracks are assigned so that the number of matches is maximal and the sum of distances minimal. A
/// match is an identity switch if the object was last matched to another track.
///
/// Source: Bernardin and Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics" (2008),
/// section 2.
class ClearMot {
 public:
  struct Counts {
    std::uint64_t objects = 0;      ///< objects in all frames
    std::uint64_t predictions = 0;  ///< tracks in all frames
    std::uint64_t matches = 0;      ///< matches without identity switches
    std::uint64_t switches = 0;
    std::uint64_t misses = 0;
    std::uint64_t false_positives = 0;
    double distance = 0.0;  ///< sum over matches and switches

    std::uint64_t detections() const { return matches + switches; }
    /// Tracking accuracy, at most 1. Empty without objects.
    std::optional<double> mota() const;
    /// Mean distance of the detections. Empty without detections.
    std::optional<double> motp() const;
  };

  ClearMot();

  /// Adds one frame: the identities of its objects and of its tracks, and the pairs that may be matched.
  void add(std::span<const std::uint64_t> objects, std::span<const std::uint64_t> tracks,
           std::span<const MotPair> allowed);

  const Counts& counts() const { return counts_; }

 private:
  void match(std::uint64_t object, std::uint64_t track, double distance);

  geometry::Assigner assigner_;
  std::map<std::uint64_t, std::uint64_t> last_;  // object to the track of its last match
  std::vector<bool> object_taken_, track_taken_;
  std::vector<geometry::AllowedPair> pairs_;
  Counts counts_;
};

}  // namespace mocap::scoring
