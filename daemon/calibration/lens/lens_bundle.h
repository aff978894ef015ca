#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/lens/find_board.h"
#include "model/camera_model.h"
#include "model/transform.h"

namespace mocap::calibration {

inline constexpr int kLensParts = 9;  ///< fx fy cx cy and the five of `distortion`
using LensVector = Eigen::Matrix<double, kLensParts, 1>;
using LensMatrix = Eigen::Matrix<double, kLensParts, kLensParts>;

/// Which parts of a lens are looked for; the others stay as they are.
using LensParts = Eigen::Array<bool, kLensParts, 1>;

/// A lens, and where it saw the boards.
struct LensBundle {
  Lens lens;
  std::vector<BoardView> views;
  std::vector<CameraFromWorld> camera_from_board;  ///< by view
};

/// What a fit leaves.
struct LensResidue {
  double sum_px2 = 0.0;  ///< of squared residuals, both axes
  std::size_t points = 0;
  std::vector<double> view_rms_px;  ///< per axis
  double rms_px() const;            ///< per axis
};

/// How the pixel of a ray moves with the lens's parts.
Eigen::Matrix<double, 2, kLensParts> pixel_by_lens(const Lens& lens, const Eigen::Vector2d& ray);

/// Moves lens and boards to the least sum of squared residuals (Levenberg-Marquardt, each board eliminated).
LensResidue adjust_lens(LensBundle& bundle, const LensParts& parts, int most_steps);

/// Only the boards move.
LensResidue place_boards(LensBundle& bundle);

/// Covariance of the parts that were looked for, for residuals of 1 px; zero elsewhere. Nothing where the views do not
/// determine them.
std::optional<LensMatrix> lens_covariance(const LensBundle& bundle, const LensParts& parts);

/// Where a board is, by a lens that is about right; nothing where too few of its corners have a ray.
std::optional<CameraFromWorld> place_board(const BoardView& view, const Lens& lens);

}  // namespace mocap::calibration
