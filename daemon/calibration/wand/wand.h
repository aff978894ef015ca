#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace mocap::calibration {

inline constexpr std::size_t kMaxWandMarkers = 3;
/// Bounds of the length of a wand. A shorter one is a wrong unit, or too short for cameras some metres away.
inline constexpr double kShortestWand_m = 0.08;
inline constexpr double kLongestWand_m = 10.0;

/// A calibration wand: a rigid rod with two or three markers on a line.
struct Wand {
  std::vector<double> marks_m;  ///< distance of each marker from the first: 0, then ascending

  double length_m() const { return marks_m.back(); }
  double middle_m() const { return 0.5 * marks_m.back(); }
  /// Whether the two ends cannot be distinguished: two markers, or a middle marker within 4 % of the midpoint.
  bool is_symmetric() const { return marks_m.size() == 2 || std::abs(marks_m[1] / marks_m.back() - 0.5) < 0.04; }
};

/// The blobs of a wand in one image: index of the blob by marker, -1 if the marker was not detected.
using WandBlobs = std::array<int, kMaxWandMarkers>;

/// Tolerances of the detection of a wand in one image.
struct WandTolerance {
  double offset_px = 1.0;         ///< largest distance of the middle marker from the line through the ends ...
  double offset_fraction = 0.01;  ///< ... plus this fraction of the wand's image length, for lens distortion
  /// Largest difference of the division ratio from the wand's own: perspective lengthens the near part of a tilted
  /// wand.
  double ratio_tolerance = 0.09;
  double min_length_px = 12.0;  ///< end to end
  std::size_t max_blobs = 48;   ///< images with more blobs are skipped: the search is cubic in their number
};

/// Tolerances for known lenses (the rays are undistorted), or for lenses of which only the field of view is known.
WandTolerance wand_tolerance(bool lenses_known);

/// The result of a detection in one image.
struct WandDetection {
  bool found = false;      ///< exactly one candidate, or one that is clearly the best
  bool two_wands = false;  ///< two candidates without a common blob
  WandBlobs blobs{-1, -1, -1};
};

/// Detects the wand among the blobs of one image (undistorted, px). Three markers are found by collinearity and
/// division ratio; two markers only if the image has exactly two blobs. Time: cubic in the number of blobs.
WandDetection detect_wand(std::span<const Eigen::Vector2d> blobs_px, const Wand& wand, const WandTolerance& tolerance);

}  // namespace mocap::calibration
