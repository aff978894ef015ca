#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "model/blob.h"
#include "scene/random.h"

namespace mocap::simworld {

/// A light in an image.
struct Spot {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0.0;
  std::uint32_t light = 0;  ///< whose; the caller's own number
};

/// What the detector makes of the discs of one image, without drawing them: their blobs with its noise, its sigma, its
/// areas, and one blob for those that it cannot tell apart.
///
/// Its figures are those of the default detector on the default rendering (peak 230 over background 12, noise 2, blur
/// 0.5 px), radius 1.5 to 6 px; a test holds the two against each other.
class BlobMaker {
 public:
  /// `noise` times the detector's own.
  explicit BlobMaker(double noise) : noise_(noise) {}

  /// Appends the blobs of the spots, in no order; gives which blob shows each spot (kNone: no room for it).
  std::span<const std::uint32_t> see(std::span<const Spot> spots, scene::Random& random, Blobs& into);

  /// Appends a blob of something that is no marker, anywhere in the image.
  void add_false(int width_px, int height_px, scene::Random& random, Blobs& into) const;

  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

 private:
  Blob alone(const Spot& spot, double added_px, double told_px, scene::Random& random) const;
  Blob joined(std::span<const Spot* const> spots, scene::Random& random) const;

  double noise_;
  std::vector<std::uint32_t> group_of_, blob_of_;
  std::vector<bool> touched_, doubtful_;
  std::vector<const Spot*> members_;
};

}  // namespace mocap::simworld
