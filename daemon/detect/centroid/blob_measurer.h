#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/bounded_vector.h"
#include "detect/centroid/neighbour_eraser.h"
#include "detect/centroid/waist.h"
#include "detect/centroid/weighted_centroid.h"
#include "detect/components/image_components.h"
#include "detect/kernels/detect_kernels.h"
#include "model/blob.h"
#include "model/frame.h"

namespace mocap::detect {

/// A component's blobs: one, or two where two markers touch.
using ComponentBlobs = BoundedVector<Blob, 2>;

inline constexpr int kMaxFits = 128;

/// Measures components on the pixels of their image. One thread; allocates in the constructor only.
///
/// A pixel weighs by a cubic of u, its grey from a little over the dark (0) to the blob's plateau (1). The likelihood
/// asks that the weight's slope at u be the slope of the light at that place over the distance from the middle; the
/// cubic of each radius and width of the edge comes close, and leaves the grid little. The centroid of such weights is
/// the middle of anything symmetric. Discs that the range cuts off, and those parted from another, are fitted.
class BlobMeasurer {
 public:
  BlobMeasurer(const DetectKernels& kernels, int grow_px, bool split_touching);

  /// Begins an image: what is measured from now on is of that one. The first kMaxFits saturated discs of an image are
  /// fitted, which costs some microseconds each; further ones get the weighted mean and a sigma that says so.
  void begin_image() {
    fits_left_ = kMaxFits;
    deferred_components_.clear();
    intensity_sums_.clear();
  }

  /// Asks for the memory of a component that is measured soon.
  void prefetch(const Image& image, const Shape& shape) const;

  /// Measures component `i` of those joined, of that shape and roundness, on the image. What is plain, alone and round,
  /// is only weighed.
  void measure(const Image& image, const GreyLevels& grey_levels, ImageComponents& components, std::size_t i,
               const Shape& shape, double roundness);

  /// Ends an image: tells the blobs of what was only weighed, several at once, as one waits for its own roots. Shapes
  /// and roundness are those of all components.
  void finish(const GreyLevels& grey_levels, std::span<const Shape> shapes);

  /// The blobs of component `i`, which was measured.
  std::span<const Blob> blobs(std::size_t i) const { return {component_blobs_[i].begin(), component_blobs_[i].end()}; }

 private:
  struct Window {
    int x, y, width_px, height_px;  // in the image, without what fills the box up
  };

  Window window_of(const Image& image, const Shape& shape) const;
  BoxStatistics fetch(const Image& image, const GreyLevels& grey_levels, const Window& window);
  std::uint32_t count_at_top(const GreyLevels& grey_levels, const BoxStatistics& statistics) const;
  IntensitySums weigh(const GreyLevels& grey_levels, const Window& window, const BoxStatistics& statistics,
                      double roundness) const;
  void refine(const GreyLevels& grey_levels, const Window& window, MeasuredBlob& weighed);
  bool fit_side(const GreyLevels& grey_levels, const Window& window, const BoxStatistics& statistics, Blob& blob);
  Waist waist_of(const GreyLevels& grey_levels, const Window& window, const Shape& shape) const;
  ComponentBlobs split(const GreyLevels& grey_levels, const Window& window, const Shape& shape, const Waist& waist);

  const DetectKernels& kernels_;
  int grow_px_;
  bool split_touching_;
  int fits_left_ = kMaxFits;
  std::vector<std::uint16_t> pixels_;
  std::vector<std::uint16_t> saved_;
  NeighbourEraser eraser_;
  std::array<double, 2048> plateau_excess_;  // the plateau of a disc of so many pixels, in standard deviations
  Box box_;
  BoundedVector<std::size_t, kMaxBlobs> deferred_components_;  // components that were only weighed
  std::vector<IntensitySums> intensity_sums_;                  // of those
  std::vector<ComponentBlobs> component_blobs_;
};

}  // namespace mocap::detect
