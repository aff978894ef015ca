#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/bundle.h"
#include "calibration/wand/instants.h"
#include "calibration/wand/wand.h"
#include "calibration/wand/wand_recording.h"

namespace mocap::calibration {

struct WandSettings {
  bool lens_known = true;        ///< else the lenses of which Lens::is_from_fov are approximate focal lengths only
  bool refine_lens = false;      ///< estimate all intrinsics although they are calibrated
  Duration max_skew = kMaxSkew;  ///< largest difference of exposure times within an instant
  int min_samples = 60;          ///< instants at which a camera and another camera see the wand
  int max_samples = 20000;       ///< more are thinned out evenly
  int threads = 2;
};

/// The reason why a recording gives no rig.
enum class WandFault {
  NoWand,          ///< a camera does not see a wand
  WrongWand,       ///< three collinear markers, but with another division ratio
  TwoWands,        ///< two wands in many images
  StillWand,       ///< the wand does not move
  TooFewSamples,   ///< too few instants with the wand in two cameras
  NoOverlap,       ///< a camera shares too little with the others, or is inconsistent with them
  Mirrored,        ///< the images of a camera are mirrored
  NotSynchronous,  ///< the exposure times of a camera are wrong
  WrongImageSize,  ///< blobs outside the image for which the intrinsics were calibrated
  NoSolution,      ///< the adjustment failed or was cancelled
};

struct WandError {
  WandFault fault;
  std::string message;  ///< names the camera, the figure, what was expected and what to do
};

/// The message of a NoSolution error after `progress` returned false.
inline constexpr const char* kCancelled = "cancelled before there was a solution";

/// Reprojection residual of one wand marker.
struct ObservationResidual {
  int camera = 0;                                         ///< index in the rig
  PixelPoint at;                                          ///< observed
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< observed minus projected
  /// Whether the rig of this residual was adjusted without the sample (its wand pose was estimated from the sample).
  bool held_out = false;
};

/// The figures of one camera in a solution.
struct CameraAccuracy {
  double rms_px = 0.0;                         ///< per axis
  std::optional<double> heldout_px;            ///< per axis, of held-out samples; nothing: too few, or not measured
  std::size_t points = 0;                      ///< observations
  double coverage = 0.0;                       ///< fraction of the 8 x 8 image cells with an observation
  std::optional<PoseUncertainty> uncertainty;  ///< nothing: the observations do not determine the rig
  double time_offset_s = 0.0;                  ///< positive: the camera exposes after the others
  double time_offset_sigma_s = 0.0;            ///< infinite: the offset is unknown
  bool synchronisation_checked = false;        ///< a time offset that is too large would have been seen
};

/// A rig in the frame of its first camera. The functions of floor/ move it into a world frame.
struct WandSolution {
  Bundle bundle;
  std::vector<CameraAccuracy> cameras;
  double rms_px = 0.0;               ///< per axis, of all observations
  std::optional<double> heldout_px;  ///< per axis, of held-out samples; nothing: too few, or not measured
  double length_mean_m = 0.0;        ///< of the wand, end to end, from rays alone; 0: no wand pose gives a length
  double length_std_m = 0.0;
  double length_min_m = 0.0;
  double length_max_m = 0.0;
  std::size_t samples = 0;     ///< wand poses with observations
  Eigen::MatrixXd covariance;  ///< of the camera poses, as in RigCovariance
  /// Residuals of all observations, then again of every tenth sample with a rig that was adjusted without these
  /// samples.
  std::vector<ObservationResidual> residuals;
};

/// Receives the current step and the fraction of it that is done. Returning false cancels the calibration.
using Progress = std::function<bool(const char* step, double fraction)>;

/// Calibrates the extrinsics (and the intrinsics that are not known or to be refined) of all cameras from a recording
/// of a waved wand: detects the wand in each image, estimates relative poses of pairs of cameras, joins them, and runs
/// bundle adjustment in stages with decreasing gates. `start` gives names, image sizes and intrinsics; its poses are
/// ignored.
///
/// Deterministic with one thread; with more, the sums of Ceres differ in their rounding. Allocates. Sources: see
/// estimate_two_view_geometry and adjust_bundle.
Result<WandSolution, WandError> solve_wand(const Take& recording, const Rig& start, const Wand& wand,
                                           const WandSettings& settings, const Progress& progress = {});

}  // namespace mocap::calibration
