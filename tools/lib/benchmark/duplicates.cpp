#include "lib/benchmark/duplicates.h"

#include <algorithm>

namespace mocap::benchmark {
namespace {

// The smallest marker in common use on a body has a diameter of 9.5 mm.
constexpr double kDiameter_m = 0.0095;

class DuplicateFinder {
 public:
  explicit DuplicateFinder(const LabelledClip& clip)
      : clip_(clip), found_{std::vector<bool>(clip.take.places_m.size()), std::vector<bool>(clip.others_m.size())} {}

  Duplicates find() {
    for (std::size_t other = 0; other < clip_.other.size(); ++other) {
      for (std::size_t begin = 0; begin < clip_.frames();) {
        std::size_t end = begin;
        while (end < clip_.frames() && other_at(end, other).allFinite()) ++end;
        mark(other, begin, end);
        begin = std::max(end, begin + 1);
      }
    }
    return found_;
  }

 private:
  const Eigen::Vector3d& other_at(std::size_t frame, std::size_t other) const {
    return clip_.others_m[frame * clip_.other.size() + other];
  }

  // Marks a point that is visible from frame `begin` to before `end`, and each marker that it meets in that time.
  void mark(std::size_t other, std::size_t begin, std::size_t end) {
    for (std::size_t marker = 0; marker < clip_.take.markers; ++marker) {
      bool meets = false;  // not for a marker in a gap: its position is not finite
      for (std::size_t frame = begin; frame < end && !meets; ++frame) {
        meets = (clip_.take.frame(frame)[marker] - other_at(frame, other)).norm() < kDiameter_m;
      }
      for (std::size_t frame = begin; frame < end && meets; ++frame) {
        found_.markers[frame * clip_.take.markers + marker] = true;
        found_.others[frame * clip_.other.size() + other] = true;
      }
    }
  }

  const LabelledClip& clip_;
  Duplicates found_;
};

}  // namespace

Duplicates find_duplicates(const LabelledClip& clip) { return DuplicateFinder(clip).find(); }

}  // namespace mocap::benchmark
