#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "detect/row_mask.h"
#include "model/frame.h"
#include "model/image_mask.h"

namespace mocap::detect {

struct LearnMaskSettings {
  double least_share = 0.25;  ///< of the images in which a pixel shines that is to be masked, more than 0 to 1
  double margin_px = 4.0;     ///< a mask reaches so far over what shone, 0 to 100
};

/// What shone in an empty volume.
struct LearntMask {
  std::vector<MaskPolygon> polygons;  ///< convex, corners to a tenth of a pixel
  std::size_t lights = 0;             ///< connected regions that they cover; a region that is not convex takes several
  /// Regions that shone now and then, or moved: nothing of them is masked. They are somebody's markers, and then the
  /// volume was not empty.
  std::size_t moved = 0;
  double covered_share = 0.0;  ///< of the image, with what was masked before
};

/// Learns where an empty volume shines: lamps, windows, the ring lights of other cameras. One thread.
class MaskLearner {
 public:
  /// What is `masked` already is left out of what is learnt.
  MaskLearner(int width_px, int height_px, std::span<const MaskPolygon> masked = {});

  /// Takes in one image, whole and of the size told: its pixels from `threshold_grey` (0 to 255) on shine. False, and
  /// nothing is taken, where it is not such an image.
  bool add(const Image& image, double threshold_grey);

  std::size_t images() const { return images_; }

  /// What the images so far tell: every connected region of pixels that ever shone (a single flicker of noise
  /// excepted) and that stayed: all of it lies within half the margin of the pixels that shone most. A marker that
  /// moves, or sways with somebody who stands, leaves a trail that does not: it is not masked, nor is a lamp that it
  /// passed before.
  LearntMask learn(const LearnMaskSettings& settings) const;

  struct Pixel {
    int x, y;
  };
  using Pixels = std::vector<Pixel>;

 private:
  Pixels pixels_above(const Pixels& region, std::uint32_t least) const;
  bool is_static(const Pixels& region, std::uint32_t most, double margin_px) const;
  std::uint32_t count_at(const Pixel& at) const {
    return bright_count_[static_cast<std::size_t>(at.y) * row_.size() + static_cast<std::size_t>(at.x)];
  }

  int width_px_, height_px_;
  std::vector<MaskPolygon> masked_;
  RowMask known_;
  std::size_t images_ = 0;
  std::vector<std::uint32_t> bright_count_;  // in how many images each pixel did
  std::vector<std::uint16_t> row_;           // of the image that is taken in
};

}  // namespace mocap::detect
