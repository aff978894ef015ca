#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "bodyfit/offset_equations.h"
#include "model/skeleton.h"

namespace mocap::bodyfit {

/// What a fit left unexplained.
struct FitResiduals {
  std::vector<double> marker_rms_m;  ///< by marker; 0: never seen
  std::vector<double> bone_rms_m;    ///< by bone: of its own markers; 0: none
  std::vector<int> marker_count;     ///< by marker: instants in which it was seen
  double rms_m = 0.0;
};

struct FittedSubject {
  MarkerSet marker_set;  ///< the file's with the body's offsets
  double size = 1.0;     ///< of the body against the file's
  FitResiduals residuals;
  int instants = 0;        ///< that were fitted
  bool from_rest = false;  ///< some of them in rest pose: they say how each bone's frame lies on it
  int iterations = 0;
};

struct FitSettings {
  OffsetPriors priors;
  std::size_t max_instants = 120;    ///< the most different ones are taken
  double min_marker_fraction = 0.6;  ///< of the markers that an instant must show
};

enum class FitFailure { NothingSeen };

/// Labelled markers of one recording: frame by frame, `marker_count` places each; not finite: not seen.
struct LabelledTake {
  std::size_t markers = 0;
  std::vector<Eigen::Vector3d> places_m;

  std::size_t frames() const { return markers == 0 ? 0 : places_m.size() / markers; }
  std::span<const Eigen::Vector3d> frame(std::size_t i) const {
    return std::span(places_m).subspan(i * markers, markers);
  }
};

/// Fits a body to takes of it: its bones' lengths, where its joints are and where its markers sit on it. `at_rest`: a
/// T-pose or A-pose that is held (what hangs down is taken as it is); `moving`: the more different the poses, the
/// better it is known. Either may be empty; what neither tells is as the file says, at the body's size.
///
/// z is up. Deterministic.
Result<FittedSubject, FitFailure> fit_subject(const MarkerSet& file, const LabelledTake& at_rest,
                                              const LabelledTake& moving, const FitSettings& settings);

/// How far the markers of a take are from a body, in the best pose of each frame; every `step`th frame is looked at.
FitResiduals residuals_of(const MarkerSet& body, const LabelledTake& take, std::size_t step);

}  // namespace mocap::bodyfit
