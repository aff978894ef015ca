#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calibration/floor/floor.h"
#include "calibration/rig/judge_rig_volume.h"
#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

inline constexpr int kImageFields = 8;  ///< an image is looked at in 8 x 8 fields

/// All that is known of a rig; what is not known stays empty.
struct RigEvidence {
  Rig rig;                                ///< in the world that the report is about
  std::vector<SightResidual> residuals;   ///< camera: index in the rig
  std::vector<double> lengths_m;          ///< of the wand, by rays alone
  double told_length_m = 0.0;             ///< what the wand measures; 0: there was none
  std::vector<Eigen::Vector3d> points_m;  ///< where markers were: the volume is about these
  Eigen::MatrixXd covariance;             ///< as RigDoubt has it, in the rig's axes
  std::optional<double> floor_rms_m;      ///< of what the floor was laid by; nothing: there is no floor yet
};

/// What a wand's solution tells; laid on `floor` where there is one, else turned so that z is about upright.
RigEvidence evidence_of(const WandSolution& solution, const std::optional<Floor>& floor);

enum class Grade { Excellent, Good, Fair, Poor };
const char* name_of(Grade grade);

/// Something that keeps a rig from a better grade, and what to do about it.
struct RigIssue {
  Grade grade = Grade::Good;
  std::string text;
};

struct ImageField {
  int points = 0;
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< mean
};

struct CameraJudgement {
  std::string name;
  double rms_px = 0.0;               ///< per axis, of the sights that the rig was made of
  std::optional<double> heldout_px;  ///< of those that had no say in it
  std::size_t points = 0;
  std::size_t heldout_points = 0;
  double coverage = 0.0;  ///< share of the fields with at least a point
  /// Root mean square of the fields' mean residuals, less what chance gives: what the lens does not explain.
  double pattern_px = 0.0;
  double position_doubt_m = 0.0;
  double rotation_doubt_rad = 0.0;
  std::array<ImageField, kImageFields * kImageFields> fields{};  ///< row by row
};

struct WandJudgement {
  double told_m = 0.0;
  double mean_m = 0.0;
  double std_m = 0.0;
  double min_m = 0.0;
  double max_m = 0.0;
  std::size_t samples = 0;
};

struct FloorJudgement {
  double rms_m = 0.0;
  double lowest_camera_m = 0.0;  ///< over the floor
};

struct RigJudgement {
  Grade grade = Grade::Excellent;
  std::vector<RigIssue> issues;  ///< the worst first
  std::vector<CameraJudgement> cameras;
  double rms_px = 0.0;
  std::optional<double> heldout_px;
  std::optional<WandJudgement> wand;
  std::optional<double> scale_error;  ///< measured wand over told one, less one
  std::optional<FloorJudgement> floor;
  std::optional<VolumeUncertainty> volume;
};

/// Weighs the evidence: figures, a grade, and what to do about a bad one. The grade is that of the worst issue.
RigJudgement judge_rig(const RigEvidence& evidence);

}  // namespace mocap::calibration
