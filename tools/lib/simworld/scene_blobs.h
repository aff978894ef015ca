#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "model/blob.h"
#include "scene/random.h"

namespace mocap::simworld {

/// The image of one light.
struct Spot {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double radius_px = 0.0;
  std::uint32_t light = 0;  ///< number of the light, chosen by the caller
};

/// Model of the detector: computes the blobs of the discs of one image without drawing the image. Models the centroid
/// error, sigma_px, the area, and one blob for discs that the detector cannot separate. The constants were measured
/// with the default detector on the default rendering (peak 230 above background 12, noise 2, blur 0.5 px) for radii
/// of 1.5 to 6 px. A test compares the model with DrawnBlobs.
class BlobMaker {
 public:
  /// `noise`: factor on the centroid error and on sigma_px of the detector.
  explicit BlobMaker(double noise) : noise_(noise) {}

  /// Appends the blobs of the spots in no particular order. Returns the blob of each spot, or kNone if `into` was full.
  /// Valid until the next call.
  std::span<const std::uint32_t> see(std::span<const Spot> spots, scene::Random& random, Blobs& into);

  /// Appends a false blob at a random position of the image.
  void add_false(int width_px, int height_px, scene::Random& random, Blobs& into) const;

  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

 private:
  Blob alone(const Spot& spot, double added_px, double sigma_px, scene::Random& random) const;
  Blob joined(std::span<const Spot* const> spots, scene::Random& random) const;

  double noise_;
  std::vector<std::uint32_t> group_of_, blob_of_;
  std::vector<bool> touched_, doubtful_;
  std::vector<const Spot*> members_;
};

}  // namespace mocap::simworld
