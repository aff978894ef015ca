#include "identify/shape_ambiguity.h"

#include <cmath>

#include "geometry/rigid_fit.h"

namespace mocap::identify {
namespace {

// Depth-first search for an assignment, pruned by the distances between markers.
class Mapping {
 public:
  Mapping(const MarkerSet& part, const MarkerSet& whole, double tolerance_m)
      : part_(part), whole_(whole), tolerance_m_(tolerance_m), is_assigned_(whole.markers.size(), false) {}

  bool extend() {
    if (to_.size() == part_.markers.size()) return !is_identity() && fits();
    for (std::size_t w = 0; w < whole_.markers.size(); ++w) {
      if (is_assigned_[w] || !agrees(w)) continue;
      is_assigned_[w] = true;
      to_.push_back(w);
      if (extend()) return true;
      to_.pop_back();
      is_assigned_[w] = false;
    }
    return false;
  }

  const MarkerCorrespondence& found() const { return to_; }

 private:
  bool agrees(std::size_t w) const {
    const Eigen::Vector3d& mine = part_.markers[to_.size()].offset_m;
    for (std::size_t p = 0; p < to_.size(); ++p) {
      const double distance_in_part_m = (part_.markers[p].offset_m - mine).norm();
      const double distance_in_whole_m = (whole_.markers[to_[p]].offset_m - whole_.markers[w].offset_m).norm();
      if (std::abs(distance_in_part_m - distance_in_whole_m) > 2.0 * tolerance_m_)
        return false;  // one tolerance for each marker
    }
    return true;
  }

  bool is_identity() const {
    if (&part_ != &whole_) return false;
    for (std::size_t p = 0; p < to_.size(); ++p) {
      if (to_[p] != p) return false;
    }
    return true;
  }

  bool fits() const {
    std::vector<geometry::PointPair> pairs;
    for (std::size_t p = 0; p < to_.size(); ++p)
      pairs.push_back({part_.markers[p].offset_m, whole_.markers[to_[p]].offset_m, 1.0});
    const auto aligned = geometry::fit_rigid(pairs);
    if (!aligned) return false;
    for (const geometry::PointPair& pair : pairs) {
      if (!((aligned->to_from * pair.from - pair.to).norm() < tolerance_m_)) return false;
    }
    return true;
  }

  const MarkerSet& part_;
  const MarkerSet& whole_;
  double tolerance_m_;
  std::vector<bool> is_assigned_;
  MarkerCorrespondence to_;
};

}  // namespace

std::optional<MarkerCorrespondence> find_shape_ambiguity(const MarkerSet& part, const MarkerSet& whole,
                                                         double tolerance_m) {
  const bool both_rigid = part.skeleton.bones.size() == 1 && whole.skeleton.bones.size() == 1;
  if (!both_rigid || part.markers.size() < 3 || part.markers.size() > whole.markers.size()) return std::nullopt;
  Mapping mapping(part, whole, tolerance_m);
  if (!mapping.extend()) return std::nullopt;
  return mapping.found();
}

bool is_same_body(const MarkerSet& a, const MarkerSet& b, double tolerance_m) {
  if (a.skeleton.bones.size() != b.skeleton.bones.size() || a.markers.size() != b.markers.size()) return false;
  for (std::size_t i = 0; i < a.skeleton.bones.size(); ++i) {
    const Bone& mine = a.skeleton.bones[i];
    const Bone& other = b.skeleton.bones[i];
    if (mine.parent != other.parent || (mine.rest_offset_m - other.rest_offset_m).norm() > tolerance_m) return false;
  }
  for (std::size_t m = 0; m < a.markers.size(); ++m) {
    const MarkerOnBone& mine = a.markers[m];
    const MarkerOnBone& other = b.markers[m];
    if (mine.bone != other.bone || (mine.offset_m - other.offset_m).norm() > tolerance_m) return false;
  }
  return true;
}

}  // namespace mocap::identify
