#include "wire/codec/encode.h"
#include "wire/codec/encode_numbers.h"

namespace mocap::wire {
namespace {

void add_sighting(const WorldPoint& position, const Eigen::Matrix3d& covariance_m2, CameraBits seen_by,
                  v1::Sightings& into) {
  for (int axis = 0; axis < 3; ++axis) into.add_positions_m(static_cast<float>(position.v[axis]));
  for (int row = 0; row < 3; ++row) {
    for (int column = row; column < 3; ++column)
      into.add_covariances_m2(static_cast<float>(covariance_m2(row, column)));
  }
  into.add_seen_by(seen_by);
}

}  // namespace

void encode(const Snapshot& from, v1::Sightings& into) {
  into.Clear();
  into.set_number(from.number);
  into.set_description_version(from.description_version);
  into.set_exposed_at_ns(to_ns(from.instants.exposed_at));
  for (const SubjectLabels& labels : from.labels) {
    for (std::uint32_t i = 0; i < labels.markers.size(); ++i) {
      const LabelledMarker& marker = labels.markers[i];
      if (marker.state == LabelState::Lost) continue;
      into.add_subjects_plus_one(labels.subject.value + 1);
      into.add_markers(i);
      into.add_filled(marker.state == LabelState::Filled);
      add_sighting(marker.position, marker.covariance_m2, marker.seen_by, into);
    }
  }
  for (const UnlabelledMarker& marker : from.unlabelled) {
    into.add_subjects_plus_one(0);
    into.add_markers(plus_one(marker.track));
    into.add_filled(false);
    add_sighting(marker.position, marker.covariance_m2, marker.seen_by, into);
  }
}

}  // namespace mocap::wire
