#pragma once

#include <array>
#include <cstddef>

namespace mocap::geometry {

/// Estimates the distance between the centres of two equal discs that overlap in an image from the shape of their
/// union.
///
/// Lengths are in radii of one disc. Discs more than two radii apart do not overlap, but blur may join them to one blob
/// up to kMax.
class TwoDiscs {
 public:
  static constexpr double kMax = 2.6;

  TwoDiscs();

  /// The distance of the centres, from the area of the union divided by the area of one disc (1 to 2).
  double distance_from_area(double area_ratio) const;

  /// The distance of the centres, from the ratio of the union's axes of inertia (1: one disc, to
  /// sqrt(1 / (1 + kMax^2))).
  double distance_from_roundness(double roundness) const;

 private:
  static constexpr std::size_t kSteps = 53;

  std::array<double, kSteps> area_ratio_;  // for distances 0 to kMax
  std::array<double, kSteps> roundness_;
};

/// The shape of a disc that is partly hidden behind a straight edge, such as a barrier or the border of the image.
///
/// Lengths are in radii of the disc.
class CutDisc {
 public:
  struct Shape {
    double offset;     ///< from the centroid of the visible part to the centre of the disc, across the cut
    double roundness;  ///< ratio of the axes of inertia of the visible part; the cut is parallel to the longer axis
  };

  CutDisc();

  /// `share` is the visible share of the disc's area, 0 to 1.
  Shape shape(double share) const;

 private:
  static constexpr std::size_t kSteps = 51;

  std::array<Shape, kSteps> shapes_;  // for shares 0 to 1
};

}  // namespace mocap::geometry
