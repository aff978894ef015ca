#include "identify/front_back_ambiguity.h"

#include <optional>
#include <vector>

#include "identify/asymmetry.h"
#include "kinematics/pose_fit.h"

namespace mocap::identify {

bool has_front_back_ambiguity(const MarkerSet& set, const FindSettings& settings) {
  const std::vector<int> opposite = opposite_bones(set.skeleton);
  MarkerSet flipped_set = set;
  for (MarkerOnBone& marker : flipped_set.markers) {
    const bool on_limb = opposite[static_cast<std::size_t>(marker.bone)] != marker.bone;
    if (on_limb) marker.offset_m.x() = -marker.offset_m.x();
  }
  const kinematics::PoseFit posed_body(flipped_set, kinematics::PoseFit::Lengths::Fixed);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t m = 0; m < flipped_set.markers.size(); ++m) points.push_back(posed_body.marker_at(m));

  const std::optional<FoundBody> found = TPoseFinder(set, settings, points.size()).find(points);
  if (!found) return false;
  std::size_t wrong = 0;
  for (std::size_t m = 0; m < points.size(); ++m) {
    const int point = found->point_of_marker[m];
    wrong += point >= 0 && point != static_cast<int>(m) ? 1 : 0;
  }
  return 2 * wrong > points.size();  // fewer wrong markers are exchanges of neighbours, not a half turn of the body
}

}  // namespace mocap::identify
