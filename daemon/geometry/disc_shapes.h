#pragma once

#include <array>
#include <cstddef>

namespace mocap::geometry {

/// The shape of two equal discs that overlap in an image, and back: how far their centres lie apart.
///
/// Lengths are in radii of one disc. Beyond two radii the discs are apart; up to kMax they may still be one blob, where
/// blur joins them.
class TwoDiscs {
 public:
  static constexpr double kMax = 2.6;

  TwoDiscs();

  /// Distance of the centres from the area of the union over the area of one disc (1 to 2).
  double distance_from_area(double area_ratio) const;

  /// The same from the ratio of the union's axes of inertia (1: a disc, to sqrt(1 / (1 + kMax^2))).
  double distance_from_roundness(double roundness) const;

 private:
  static constexpr std::size_t kSteps = 53;

  std::array<double, kSteps> area_ratio_;  // of distances 0 to kMax
  std::array<double, kSteps> roundness_;
};

/// The shape of a disc of which a straight edge hides a part, such as a barrier's or the image's.
///
/// Lengths are in radii of the disc.
class CutDisc {
 public:
  struct Shape {
    double offset;     ///< from the middle of what is seen to the centre of the disc, across the cut
    double roundness;  ///< ratio of the axes of inertia; the cut is along the longer one
  };

  CutDisc();

  /// From the share of the disc's area that is seen, 0 to 1.
  Shape shape(double share) const;

 private:
  static constexpr std::size_t kSteps = 51;

  std::array<Shape, kSteps> shapes_;  // of shares 0 to 1
};

}  // namespace mocap::geometry
