#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/image_cells.h"
#include "calibration/rig/rig_evidence.h"
#include "calibration/rig/volume_uncertainty.h"

namespace mocap::calibration {

enum class Grade { Excellent, Good, Fair, Poor };
const char* name_of(Grade grade);

/// A reason why a rig has no better grade, with an advice.
struct RigIssue {
  Grade grade = Grade::Good;
  std::string text;
};

struct ImageCell {
  int points = 0;
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< mean
};

struct CameraAssessment {
  std::string name;
  double rms_px = 0.0;               ///< per axis, of the observations that the rig was adjusted to
  std::optional<double> heldout_px;  ///< per axis, of held-out observations
  std::size_t points = 0;
  std::size_t heldout_points = 0;
  double coverage = 0.0;  ///< fraction of the image cells with an observation
  /// Systematic residual: rms of the mean residuals of the image cells, less the part that noise explains. A wrong lens
  /// model gives a systematic residual.
  double systematic_px = 0.0;
  std::optional<double> position_sigma_m;  ///< nothing: the observations do not determine the rig
  std::optional<double> rotation_sigma_rad;
  std::array<ImageCell, kImageCells * kImageCells> cells{};  ///< row by row
};

struct WandAssessment {
  double nominal_m = 0.0;
  double mean_m = 0.0;
  double std_m = 0.0;
  double min_m = 0.0;
  double max_m = 0.0;
  std::size_t samples = 0;
};

struct RigAssessment {
  Grade grade = Grade::Excellent;
  std::vector<RigIssue> issues;  ///< the worst first
  std::vector<CameraAssessment> cameras;
  double rms_px = 0.0;
  std::optional<double> heldout_px;
  std::optional<WandAssessment> wand;
  /// Mean of the triangulated length of the wand over its nominal length, minus 1. No evidence of the scale, which the
  /// adjustment takes from the nominal length: a wand of another length gives 0, too.
  std::optional<double> wand_mismatch;
  std::optional<double> lowest_camera_m;  ///< above the measured floor; nothing: no floor was measured
  std::optional<VolumeUncertainty> volume;
};

/// Computes the figures of a rig, grades them against fixed limits and lists what to improve. The grade of the rig is
/// that of its worst issue.
RigAssessment assess_rig(const RigEvidence& evidence);

}  // namespace mocap::calibration
