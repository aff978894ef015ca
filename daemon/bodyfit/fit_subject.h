#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "base/result.h"
#include "bodyfit/offset_equations.h"
#include "model/skeleton.h"

namespace mocap::bodyfit {

/// Distances between measured and modelled marker positions after a fit.
struct FitResiduals {
  std::vector<double> marker_rms_m;  ///< by marker; 0: never measured
  std::vector<double> bone_rms_m;    ///< by bone, over its own markers; 0: none measured
  std::vector<int> marker_count;     ///< by marker: number of instants in which it was measured
  double rms_m = 0.0;                ///< over all markers
};

struct FittedSubject {
  MarkerSet marker_set;  ///< the file's marker set with fitted offsets
  double size = 1.0;     ///< size of the body relative to the file
  FitResiduals residuals;
  int instants = 0;        ///< number of fitted instants
  bool from_rest = false;  ///< an instant in rest pose determines the axes of the bones
  int iterations = 0;
};

struct FitSettings {
  OffsetPriors priors;
  std::size_t max_instants = 120;    ///< the instants with the most different poses are used
  double min_marker_fraction = 0.6;  ///< fraction of the markers that an instant must have
};

/// NothingSeen: no instant has enough markers.
enum class FitFailure { NothingSeen };

/// Labelled markers of one recording: frame after frame, `markers` positions each, in the world frame; not finite: not
/// measured.
struct LabelledTake {
  std::size_t markers = 0;
  std::vector<Eigen::Vector3d> places_m;

  std::size_t frames() const { return markers == 0 ? 0 : places_m.size() / markers; }
  std::span<const Eigen::Vector3d> frame(std::size_t i) const {
    return std::span(places_m).subspan(i * markers, markers);
  }
};

/// Fits the bone lengths, joint positions and marker offsets of a body to takes of it. `at_rest`: the subject holds a
/// T-pose or A-pose; joints that are far from rest pose (arms that hang down) have no rest-pose constraint. `moving`:
/// the more the poses differ, the more offsets are observable. Either take may be empty. An unobservable offset is that
/// of the file times the size of the body.
///
/// z is up. Fails with NothingSeen if no instant has enough markers. Equal takes give an equal result.
Result<FittedSubject, FitFailure> fit_subject(const MarkerSet& file, const LabelledTake& at_rest,
                                              const LabelledTake& moving, const FitSettings& settings);

/// The residuals of a take for a fitted body, in the pose that is tracked through every `step`th frame. Frames with
/// less than 30 % of the markers are left out.
FitResiduals residuals_of(const MarkerSet& body, const LabelledTake& take, std::size_t step);

}  // namespace mocap::bodyfit
