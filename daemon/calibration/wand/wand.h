#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace mocap::calibration {

inline constexpr std::size_t kMostMarks = 3;

/// A stiff stick with two or three markers on a line.
struct Wand {
  std::vector<double> marks_m;  ///< place of each marker along it, from the first: 0, then ascending

  double length_m() const { return marks_m.back(); }
  double middle_m() const { return 0.5 * marks_m.back(); }
  /// Whether it looks the same from either end.
  bool reads_both_ways() const { return marks_m.size() == 2 || std::abs(marks_m[1] / marks_m.back() - 0.5) < 0.04; }
};

/// Where the spots of a wand are in one picture: index of the spot by marker, -1 where it was not seen.
using WandSpots = std::array<int, kMostMarks>;

/// What is taken for a wand in a picture.
struct WandShape {
  double straight_px = 1.0;      ///< a middle marker may lie so far off the line
  double straight_share = 0.01;  ///< and so much of the wand's length in the image more: what the lens bends
  double ratio_slack = 0.09;     ///< of where the middle marker divides it: a tilted wand's near half looks longer
  double shortest_px = 12.0;     ///< end to end
  std::size_t most_spots = 48;   ///< with more the picture tells nothing
};

/// As it fits lenses that are known, or that are only about as wide as is said.
WandShape wand_shape(bool lens_known);

/// What a picture shows.
struct WandLook {
  bool seen = false;   ///< just one reading, or one that is clearly the best
  bool twice = false;  ///< two wands that share no spot
  WandSpots spots{-1, -1, -1};
};

/// Looks for the wand among the spots of one picture. Of two markers, only where there are no other spots.
WandLook find_wand(std::span<const Eigen::Vector2d> spots_px, const Wand& wand, const WandShape& shape);

}  // namespace mocap::calibration
