#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/bundle.h"
#include "calibration/wand/wand.h"
#include "calibration/wand/wand_recording.h"

namespace mocap::calibration {

struct WandSettings {
  bool lens_known = true;    ///< the rig's lenses are good; else only about as wide as they say
  bool refine_lens = false;  ///< solve for known lenses, too
  Duration most_skew = std::chrono::milliseconds(5);  ///< pictures of one instant lie no further apart
  int least_samples = 60;                             ///< instants in which a camera and another see the wand
  int most_samples = 20000;                           ///< more are thinned out evenly
  int threads = 2;
};

/// Why a take gives no rig.
enum class WandFault {
  NoWand,     ///< a camera saw none
  WrongWand,  ///< three markers on a line, but not divided as told
  TwoWands,
  StillWand,
  TooFewSamples,
  NoOverlap,       ///< a camera that shares too little with the others
  Mirrored,        ///< a camera whose images are
  NotSynchronous,  ///< a camera's time is off
  WrongImageSize,  ///< spots where the lens file has no image
  NoSolution,
};

struct WandRefusal {
  WandFault fault;
  std::string message;  ///< names the camera, the figure, what was expected, what to do
};

/// How far off one marker of the wand was seen.
struct SightResidual {
  int camera = 0;
  PixelPoint at;                                          ///< where it was seen
  Eigen::Vector2d residual_px = Eigen::Vector2d::Zero();  ///< seen minus projected
  bool held_out = false;  ///< its sample had no say in the rig that it is projected by, only in where the wand was
};

/// A camera's share in a solution.
struct CameraQuality {
  double rms_px = 0.0;      ///< per axis
  double heldout_px = 0.0;  ///< the same of samples that had no say in the rig; 0 where there were too few
  std::size_t points = 0;   ///< markers that it saw and that count
  double coverage = 0.0;    ///< share of its image's 8 x 8 fields with at least a point
  CameraDoubt doubt;
  double late_s = 0.0;  ///< its pictures are taken so long after those of the others
  double late_sigma_s = 0.0;
};

/// Cameras in a frame of their own: the first camera's. `floor` lays them on the ground.
struct WandSolution {
  Bundle bundle;
  std::vector<CameraQuality> cameras;
  double rms_px = 0.0;         ///< per axis, of all
  double heldout_px = 0.0;     ///< the same of samples that had no say in the rig; 0 where there were too few
  double length_mean_m = 0.0;  ///< end to end, triangulated without being told the length
  double length_std_m = 0.0;
  double length_min_m = 0.0;
  double length_max_m = 0.0;
  std::size_t samples = 0;     ///< instants
  Eigen::MatrixXd covariance;  ///< of centres and turns, as RigDoubt has it
  /// Every sight of the solution, then those of each tenth sample again, by a rig that was solved without them.
  std::vector<SightResidual> residuals;
};

/// What is being done, and which share of it is done. False ends it.
using Progress = std::function<bool(const char* doing, double share)>;

/// Solves for all cameras by a wand that was waved: finds it in each picture, relates cameras in pairs, joins these
/// over the overlaps that tell most, and adjusts everything at once. `start` gives names, image sizes and lenses; where
/// its cameras stand is not looked at.
///
/// Deterministic. Allocates. Sources: as relate and adjust say.
Result<WandSolution, WandRefusal> solve_wand(const Take& take, const Rig& start, const Wand& wand,
                                             const WandSettings& settings, const Progress& progress = {});

}  // namespace mocap::calibration
