#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/image_cells.h"
#include "calibration/lens/find_board.h"
#include "calibration/lens/lens_bundle.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// The part of a camera's image in which boards were seen.
struct LensCoverage {
  std::array<int, kImageCells * kImageCells> corners{};  ///< number of corners by image cell, row by row
  double share = 0.0;                                    ///< fraction of the cells with a corner
  /// 99th percentile of the corners' distances from the image centre, as a fraction of that of the image corners.
  double reach = 0.0;
  double tilt_rad = 0.0;  ///< largest angle between two boards; 0 before a fit
};

LensCoverage coverage_of(const std::vector<BoardView>& views, int width_px, int height_px);

struct LensFit {
  Lens lens;
  IntrinsicVector sigma = IntrinsicVector::Zero();  ///< standard deviations; 0 for parameters that were not estimated
  IntrinsicMask estimated = IntrinsicMask::Constant(false);
  std::vector<std::string> not_estimated;  ///< distortion terms that stay 0, each with the reason
  double rms_px = 0.0;                     ///< per axis
  double heldout_px = 0.0;                 ///< per axis, by cross-validation
  double corner_sigma_px = 0.0;            ///< see MappingUncertainty
  double rim_sigma_px = 0.0;
  LensCoverage coverage;
  std::size_t views = 0;              ///< boards that were used
  std::vector<std::size_t> left_out;  ///< indices of views that are inconsistent with the others
};

/// Estimates the intrinsics of one camera from views of a board.
///
/// Distortion terms are added one after the other as long as each explains significantly more than noise. Fails with
/// InvalidArgument and an advice if the views do not determine focal length and principal point: too few boards, boards
/// that are nearly parallel, or boards in a small part of the image.
///
/// Deterministic. Allocates. Source: Zhang, "A flexible new technique for camera calibration" (2000). The initial focal
/// length comes from a search over fields of view instead of Zhang's closed form, which fisheye lenses do not have.
Result<LensFit> fit_lens(const std::vector<BoardView>& views, int width_px, int height_px, LensKind kind);

}  // namespace mocap::calibration
