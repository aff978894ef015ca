#include "bodyfit/body_offsets.h"

#include <cstddef>
#include <limits>

#include "base/expects.h"

namespace mocap::bodyfit {

BodyOffsets offsets_of(const MarkerSet& set) {
  BodyOffsets offsets;
  for (const Bone& bone : set.skeleton.bones) offsets.bones_m.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : set.markers) offsets.markers_m.push_back(marker.offset_m);
  return offsets;
}

void apply_offsets(const BodyOffsets& offsets, MarkerSet& set) {
  MOCAP_EXPECTS(offsets.bones_m.size() == set.skeleton.bones.size() && offsets.markers_m.size() == set.markers.size());
  for (std::size_t b = 0; b < offsets.bones_m.size(); ++b) set.skeleton.bones[b].rest_offset_m = offsets.bones_m[b];
  for (std::size_t m = 0; m < offsets.markers_m.size(); ++m) set.markers[m].offset_m = offsets.markers_m[m];
}

BodyInstant empty_instant(const MarkerSet& set) {
  BodyInstant instant;
  instant.seen_m.assign(set.markers.size(), Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
  instant.trust.assign(set.markers.size(), 1.0);
  for (const Bone& bone : set.skeleton.bones) instant.locals.push_back({bone.rest_offset_m, {1.0, 0.0, 0.0, 0.0}});
  instant.at_rest.assign(set.skeleton.bones.size(), 0);
  return instant;
}

double pose_distance(std::span<const Pose> one, std::span<const Pose> other) {
  double sum = 0.0;
  for (std::size_t b = one.size() == 1 ? 0 : 1; b < one.size(); ++b) {
    const double cosine = one[b].rotation.dot(other[b].rotation);
    sum += 1.0 - cosine * cosine;
  }
  return sum;
}

}  // namespace mocap::bodyfit
