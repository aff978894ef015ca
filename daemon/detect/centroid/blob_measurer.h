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

/// The blobs of a component: one, or two if two markers touch.
using ComponentBlobs = BoundedVector<Blob, 2>;

inline constexpr int kMaxFits = 128;

/// Measures components on the pixels of their image. Thread: one. Allocates in the constructor only.
///
/// The weight of a pixel is a cubic of u, its grey level between just above the background (0) and the blob's plateau
/// (1). The maximum-likelihood weight has, at u, the slope of the disc's profile divided by the distance from the
/// centre; the cubic for each radius and edge width approximates that slope and keeps the bias of the pixel grid small.
/// The weighted centroid of a symmetric profile is its centre. Saturated discs and discs split from another blob are
/// fitted.
class BlobMeasurer {
 public:
  BlobMeasurer(const DetectKernels& kernels, int grow_px, bool split_touching);

  /// Begins an image. The first kMaxFits saturated discs of an image are fitted, some microseconds each; further
  /// saturated discs get the weighted centroid with a larger sigma.
  void begin_image() {
    fits_left_ = kMaxFits;
    deferred_components_.clear();
    intensity_sums_.clear();
  }

  /// Prefetches the pixels of a component that is measured soon.
  void prefetch(const Image& image, const Shape& shape) const;

  /// Measures component `i` with the given shape and roundness. An isolated round component is only weighted; its blob
  /// is computed in `finish`.
  void measure(const Image& image, const GreyLevels& grey_levels, ImageComponents& components, std::size_t i,
               const Shape& shape, double roundness);

  /// Ends an image: computes the blobs of the components that were only weighted, several at a time to hide the latency
  /// of square roots. `shapes` and `roundness` are those of all components.
  void finish(const GreyLevels& grey_levels, std::span<const Shape> shapes);

  /// The blobs of component `i`, after it was measured.
  std::span<const Blob> blobs(std::size_t i) const { return {component_blobs_[i].begin(), component_blobs_[i].end()}; }

 private:
  struct Window {
    int x, y, width_px, height_px;  // in the image, without the padding
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
  std::array<double, 2048>
      plateau_excess_;  // by number of pixels: expected maximum of the plateau's noise, in standard deviations
  Box box_;
  BoundedVector<std::size_t, kMaxBlobs> deferred_components_;  // components that were only weighted
  std::vector<IntensitySums> intensity_sums_;                  // of the deferred components
  std::vector<ComponentBlobs> component_blobs_;
};

}  // namespace mocap::detect
