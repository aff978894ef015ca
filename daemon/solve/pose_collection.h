#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "base/archive.h"
#include "bodyfit/body_offsets.h"
#include "model/skeleton.h"

namespace mocap::solve {

/// At most `capacity` poses, the most different of those that were offered. The first one is never replaced. Allocates
/// in the constructor only.
class PoseCollection {
 public:
  PoseCollection(const MarkerSet& set, std::size_t capacity);

  std::size_t size() const { return size_; }
  std::span<const bodyfit::BodyInstant> collected() const { return std::span(collected_).first(size_); }
  void clear() { size_ = 0; }

  /// Distance to the most similar pose: the sum of the squared sines of half the angles between the joint rotations.
  double nearest(const bodyfit::BodyInstant& to) const;

  /// Adds the pose, or replaces the later of the two most similar poses if the new one differs more from all. Returns
  /// whether the pose is stored.
  bool add_if_different(const bodyfit::BodyInstant& instant);

  /// Writes the poses, or takes them over from a collection of the same capacity (see Archive). `add_if_different`
  /// reads only the distance of a pose to the earlier ones.
  void archive(Archive& members);

 private:
  void put(std::size_t at, const bodyfit::BodyInstant& instant);

  std::vector<bodyfit::BodyInstant> collected_;
  std::vector<double> distances_;
  std::size_t size_ = 0;
};

/// Copies without allocation; both have the same sizes.
void copy(const bodyfit::BodyInstant& from, bodyfit::BodyInstant& to);

}  // namespace mocap::solve
