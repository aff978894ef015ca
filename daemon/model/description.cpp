#include "model/description.h"

namespace mocap {

Description with_fit(Description description, const SubjectFit& fit) {
  MarkerSet& set = description.subjects[fit.subject.value].marker_set;
  for (std::size_t i = 0; i < set.skeleton.bones.size(); ++i) {
    set.skeleton.bones[i].rest_offset_m = fit.rest_offsets_m[i];
  }
  for (std::size_t i = 0; i < set.markers.size(); ++i) set.markers[i].offset_m = fit.marker_offsets_m[i];
  description.version = fit.description_version;
  return description;
}

}  // namespace mocap
