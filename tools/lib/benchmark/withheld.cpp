#include "lib/benchmark/withheld.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>

namespace mocap::benchmark {
namespace {

constexpr double kGate = 16.0;  // squared sigmas, as in label/association_costs.cpp

const TrackedMarker* track_at(const TrackedMarkers& tracked, const Eigen::Vector3d& at_m) {
  const TrackedMarker* nearest = nullptr;
  double least_m = kAtThePoint_m;
  for (const TrackedMarker& track : tracked) {
    const double apart_m = (track.position.v - at_m).norm();
    if (track.state == TrackState::Coasting || apart_m >= least_m) continue;
    least_m = apart_m;
    nearest = &track;
  }
  return nearest;
}

bool is_ambiguous(const AmbiguousObservations& observations, const TrackedMarker& track) {
  return std::ranges::any_of(observations, [&](const AmbiguousObservation& one) {
    return (one.position.v - track.position.v).norm() < kAtThePoint_m + 2.0 * one.sigma_m;
  });
}

// By the prediction of the marker that the labeller was given.
Withheld by_prediction(const Predictions& predicted, Label label, const TrackedMarker& track) {
  const auto own = std::ranges::find(predicted.markers, label, &PredictedMarker::label);
  if (own == predicted.markers.end()) return Withheld::NotPredicted;
  const Eigen::Vector3d off = track.position.v - own->position.v;
  const Eigen::Matrix3d spread = own->covariance_m2 + track.covariance_m2;
  return off.dot(spread.inverse() * off) < kGate ? Withheld::Unclear : Withheld::OutsideGate;
}

}  // namespace

std::string_view text_of(Withheld reason) {
  static constexpr std::array<std::string_view, kWithheldReasons> kTexts{"subject not tracked",
                                                                         "no track",
                                                                         "track not confirmed",
                                                                         "track has another label",
                                                                         "label on another point",
                                                                         "rejected by the shape",
                                                                         "label on a lost track",
                                                                         "ambiguous in its limb",
                                                                         "outside the gate",
                                                                         "not predicted",
                                                                         "unclear"};
  return kTexts[static_cast<std::size_t>(reason)];
}

Withheld why_withheld(const PointPipeline& pipeline, std::uint32_t marker, const Eigen::Vector3d& at_m) {
  const SubjectLabels& labels = pipeline.labelling().labels[0];
  if (labels.phase != SubjectPhase::Tracking) return Withheld::NotTracking;
  const TrackedMarker* track = track_at(pipeline.tracked(), at_m);
  if (track == nullptr) return Withheld::NoTrack;
  const LabelledMarker& own = labels.markers[marker];
  if (own.state == LabelState::Measured) return Withheld::LabelElsewhere;
  if (own.track == track->id) return Withheld::RejectedByShape;
  if (std::ranges::find(labels.markers, track->id, &LabelledMarker::track) != labels.markers.end())
    return Withheld::OtherLabel;
  if (track->state == TrackState::Tentative) return Withheld::Tentative;
  if (own.track.names_something()) return Withheld::LabelOnOldTrack;
  if (is_ambiguous(pipeline.labelling().ambiguous_observations, *track)) return Withheld::Ambiguous;
  return by_prediction(pipeline.predicted(), Label{labels.subject, marker}, *track);
}

}  // namespace mocap::benchmark
