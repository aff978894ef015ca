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
  double least_share = 0.25;  ///< a pixel that is bright in this share of the images is masked, above 0 to 1
  double margin_px = 4.0;     ///< margin of a mask around the bright pixels, 0 to 100
};

/// The lights of an empty volume.
struct LearntMask {
  std::vector<MaskPolygon> polygons;  ///< convex, corners to a tenth of a pixel
  std::size_t lights = 0;  ///< connected regions that the polygons cover; a concave region takes several polygons
  /// Regions that were bright at times, or moved. They are not masked: they are markers, so the volume was not empty.
  std::size_t moved = 0;
  double covered_share = 0.0;  ///< share of the image, including the masks that existed before
};

/// Learns which pixels of a camera see lamps, windows or the ring lights of other cameras, from images of an empty
/// volume. Thread: one.
class MaskLearner {
 public:
  /// Pixels that are `masked` already are excluded.
  MaskLearner(int width_px, int height_px, std::span<const MaskPolygon> masked = {});

  /// Adds one image. Pixels of at least `threshold_grey` (0 to 255) are bright. Returns false and ignores the image if
  /// the image is incomplete or of another size.
  bool add(const Image& image, double threshold_grey);

  std::size_t images() const { return images_; }

  /// The masks from the images so far: every connected region of pixels that were bright more than once, if the whole
  /// region lies within half the margin of its most frequently bright pixels. A marker that moves, or sways with a
  /// standing person, leaves a trail that does not: neither the trail nor a lamp that the trail touches is masked.
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
  std::vector<std::uint32_t> bright_count_;  // by pixel: number of images in which it was bright
  std::vector<std::uint16_t> row_;           // one row of the current image
};

}  // namespace mocap::detect
