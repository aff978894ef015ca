#include "model/calibration/calibration_markers.h"

#include "model/snapshot.h"

namespace mocap {

CalibrationMarkers measured_markers(const Snapshot& snapshot) {
  CalibrationMarkers all;
  all.exposed_at = snapshot.instants.exposed_at;
  for (const SubjectLabels& subject : snapshot.labels) {
    for (const LabelledMarker& marker : subject.markers) {
      if (marker.state != LabelState::Measured || !marker.track.names_something()) continue;
      static_cast<void>(all.markers.try_push_back({marker.track, marker.position, marker.cameras}));
    }
  }
  for (const UnlabelledMarker& marker : snapshot.unlabelled) {
    static_cast<void>(all.markers.try_push_back({marker.track, marker.position, marker.cameras}));
  }
  return all;
}

}  // namespace mocap
