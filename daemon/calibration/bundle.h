#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "calibration/wand/wand.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// Where the wand was: the middle between its ends, and the direction from the first marker to the last.
struct WandPlace {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();
};

/// One marker of the wand in one picture.
struct Sight {
  int camera = 0;
  int place = 0;  ///< index of the wand's place
  int mark = 0;   ///< index of its marker
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  double sigma_px = 0.1;
  int picture = -1;  ///< the caller's own numbers for it, carried along
  int spot = -1;
};

/// What of a lens is solved for.
enum class LensFreedom {
  Fixed,  ///< nothing: the lens files are good
  Focal,  ///< the two focal lengths
  Rough,  ///< focal lengths and the first term of distortion
  All,    ///< focal lengths, image centre, distortion
};

struct BundleSettings {
  LensFreedom lens = LensFreedom::Fixed;
  bool hold_first = true;       ///< the first camera stays where it is, and with it the frame
  bool hold_rig = false;        ///< all cameras stay: only the wand's places are looked for
  double outlier_sigmas = 3.0;  ///< a sight further off than this counts less and less; 0: all count
  int most_steps = 50;
  double settled = 1e-9;  ///< ends when the cost falls by a smaller share than this
  int threads = 1;
};

/// Cameras and the places of a wand that explain each other.
struct Bundle {
  Rig rig;
  Wand wand;
  std::vector<WandPlace> places;
  std::vector<Sight> sights;

  WorldPoint marker(const WandPlace& place, int mark) const {
    return {place.middle_m + (wand.marks_m[static_cast<std::size_t>(mark)] - wand.middle_m()) * place.along};
  }
  /// Seen minus projected, px; nothing where the marker is not in front of the camera.
  std::optional<Eigen::Vector2d> residual_px(const Sight& sight) const;
};

/// What a camera's place and turn may be wrong by, after the rig as a whole is laid on the truth.
struct CameraDoubt {
  double position_m = 0.0;    ///< standard deviation, root of the sum over three axes
  double rotation_rad = 0.0;  ///< likewise
};

/// Moves cameras, lenses and places to the least sum of squared reprojection errors, each in its sigma, with the
/// distances on the wand kept. `progress`: called with each step's number; false ends it. False when no solution came.
///
/// Source: Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle adjustment - a modern synthesis" (2000).
bool adjust(Bundle& bundle, const BundleSettings& settings, const std::function<bool(int)>& progress = {});

/// What is known of how wrong a rig is.
struct RigDoubt {
  std::vector<CameraDoubt> cameras;
  /// By camera its centre (m) and its turn (rad), three each, in the rig's axes. Of rank 6 less than its size.
  Eigen::MatrixXd covariance;
};

/// From the curvature of the cost at the solution, the wand's places eliminated, in the gauge in which the camera
/// centres as a whole neither move nor turn. `variance` scales the sights' sigmas squared to what they truly are.
/// Empty when the sights do not determine the rig.
RigDoubt doubt_of(const Bundle& bundle, LensFreedom lens, double variance);

}  // namespace mocap::calibration
