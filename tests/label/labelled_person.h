#pragma once

#include <string>

#include "kinematics/pose_fit.h"
#include "label/subject_labeller.h"
#include "label/test_tracks.h"
#include "support/test_body.h"

namespace mocap::test {

/// A person in T-pose at rest, 120 sets a second, one track for each marker; and a labeller that has just identified
/// the person. A test edits `tracked` and gives it to the labeller as the next set.
struct LabelledPerson {
  static constexpr Duration kStep = std::chrono::microseconds(8333);

  explicit LabelledPerson(const std::string& marker_set)
      : set(person(marker_set)),
        truth(set, kinematics::PoseFit::Lengths::Fixed),
        labeller({}, {"actor", set, true}, SubjectId{0}) {
    label::RecognisedSubject found;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      const auto id = static_cast<std::uint32_t>(100 + m);
      tracked.push_back(detected_track(id, truth.marker_at(m)));
      found.track_of_marker.push_back(TrackId{id});
    }
    update(tracks, tracked);
    identified = labeller.recognise(found, tracks, at);
  }

  /// Starts the next set: updates the tracks and predicts the body.
  void predict() {
    at += kStep;
    update(tracks, tracked);
    labeller.match_tracks(tracks, at);
    labeller.predict(tracks, at);
  }
  std::size_t marker(const std::string& name) const {
    std::size_t m = 0;
    while (set.markers[m].name != name) ++m;
    return m;
  }
  SubjectLabels labels() const {
    SubjectLabels labels;
    labeller.write_labels(tracks, labels);
    return labels;
  }

  MarkerSet set;
  kinematics::PoseFit truth;
  label::SubjectLabeller labeller;
  label::LabelledTracks tracks;
  TrackedMarkers tracked;  ///< by marker
  Timestamp at = from_ns(1'000'000'000);
  bool identified = false;
};

}  // namespace mocap::test
