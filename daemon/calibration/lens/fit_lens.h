#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/lens/find_board.h"
#include "calibration/lens/lens_bundle.h"
#include "model/camera_model.h"

namespace mocap::calibration {

inline constexpr int kLensFields = 8;  ///< an image is looked at in 8 x 8 fields

/// Where in a camera's image boards were seen.
struct LensCoverage {
  std::array<int, kLensFields * kLensFields> corners{};  ///< by field, row by row
  double share = 0.0;                                    ///< of the fields with a corner
  double reach = 0.0;     ///< the farthest corners' distance from the middle, over that of the image's own corner
  double tilt_rad = 0.0;  ///< widest angle between two boards, where their poses are known
};

LensCoverage coverage_of(const std::vector<BoardView>& views, int width_px, int height_px);

struct LensFit {
  Lens lens;
  LensVector sigma = LensVector::Zero();  ///< standard deviations: fx fy cx cy and distortion; 0: not looked for
  LensParts claimed = LensParts::Constant(false);
  std::vector<std::string> not_claimed;  ///< what the views do not tell, and is left at 0: which, and why
  double rms_px = 0.0;                   ///< per axis
  double heldout_px = 0.0;               ///< per axis, of boards that had no say in the lens
  double corner_sigma_px = 0.0;  ///< how well it is known in the image's corners; a turn of the camera does not count
  double rim_sigma_px = 0.0;     ///< the same on the rim of what boards covered
  LensCoverage coverage;
  std::size_t views = 0;
  std::vector<std::size_t> left_out;  ///< views whose board does not fit the others
};

/// Fits a lens to boards that one camera saw.
///
/// Parts of the distortion are taken up one after the other while they explain more than chance does. Refused
/// (InvalidArgument, with what to do) are too few boards, boards that are all nearly parallel, or that leave too much
/// of the image empty: then focal length, centre or distortion would be guesses.
///
/// Deterministic. Source: Zhang, "A flexible new technique for camera calibration" (2000), for the idea; starts from
/// several focal lengths instead of a closed form, which fisheye lenses have none of.
Result<LensFit> fit_lens(const std::vector<BoardView>& views, int width_px, int height_px, LensKind kind);

}  // namespace mocap::calibration
