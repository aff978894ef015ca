#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "geometry/assignment.h"

namespace mocap::scoring {

/// A thing of the truth and one of the tracker's that are near enough to be one, and how far apart they are.
struct MotPair {
  std::uint32_t object = 0;  ///< index in the frame
  std::uint32_t track = 0;   ///< likewise
  double distance = 0.0;
};

/// CLEAR-MOT, counted frame by frame.
///
/// A pair of the frame before stays together while it is allowed, even where a cheaper one is; what is left is
/// assigned so that as many as can be are matched, at the least sum of distances. A match is a switch when its object
/// was last matched to another track.
///
/// Source: Bernardin and Stiefelhagen, "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics" (2008),
/// section 2.
class ClearMot {
 public:
  struct Counts {
    std::uint64_t objects = 0;      ///< there were
    std::uint64_t predictions = 0;  ///< the tracker gave
    std::uint64_t matches = 0;      ///< that are no switch
    std::uint64_t switches = 0;
    std::uint64_t misses = 0;
    std::uint64_t false_positives = 0;
    double distance = 0.0;  ///< sum over matches and switches

    std::uint64_t detections() const { return matches + switches; }
    /// 1 at best; nothing without objects.
    std::optional<double> mota() const;
    /// Mean distance; nothing without detections.
    std::optional<double> motp() const;
  };

  ClearMot();

  /// One frame: the names of its objects and of its tracks, and the pairs that are allowed.
  void add(std::span<const std::uint64_t> objects, std::span<const std::uint64_t> tracks,
           std::span<const MotPair> allowed);

  const Counts& counts() const { return counts_; }

 private:
  void match(std::uint64_t object, std::uint64_t track, double distance);

  geometry::Assigner assigner_;
  std::map<std::uint64_t, std::uint64_t> last_;  // the track that each object was last matched to
  std::vector<bool> object_taken_, track_taken_;
  std::vector<geometry::AllowedPair> pairs_;
  Counts counts_;
};

}  // namespace mocap::scoring
