#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>

#include "lib/benchmark/point_pipeline.h"

namespace mocap::benchmark {

/// Why the point of a visible marker has no label in one frame.
enum class Withheld : std::uint8_t {
  NotTracking,      ///< the subject has no labels at all
  NoTrack,          ///< no 3D track was measured at the point
  Tentative,        ///< the track is not confirmed yet
  OtherLabel,       ///< the track has another label
  LabelElsewhere,   ///< the label is on another point
  RejectedByShape,  ///< the track has the label, but is off the fitted pose by more than the residual gate
  LabelOnOldTrack,  ///< the label waits on a track that is not measured now
  Ambiguous,        ///< the track is one of several markers of a limb, with hypotheses about as good
  OutsideGate,      ///< the track is more than 4 sigma from the position that the body predicts for the marker
  NotPredicted,     ///< the body predicts no position for the marker
  Unclear,  ///< inside the gate, but another label or track costs about as much, or the label waits for its limb
};
/// A label or a track at most this far from a point is that of the point; as scoring::kRightWithin_m.
inline constexpr double kAtThePoint_m = 0.02;
inline constexpr std::size_t kWithheldReasons = 11;

/// The reason in words.
std::string_view text_of(Withheld reason);

/// The reason why the point `at_m` of `marker` of the only subject has no label after the last step of the pipeline.
Withheld why_withheld(const PointPipeline& pipeline, std::uint32_t marker, const Eigen::Vector3d& at_m);

}  // namespace mocap::benchmark
