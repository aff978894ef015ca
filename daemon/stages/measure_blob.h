#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/bounded_vector.h"
#include "model/blob.h"
#include "model/frame.h"
#include "stages/detect_kernels.h"
#include "stages/image_components.h"
#include "stages/touching_discs.h"

namespace mocap::stages {

/// What is bright in an image, in the format's own levels.
struct Cut {
  std::uint32_t threshold = 1;
  std::uint32_t top = 255;  ///< the brightest value of the format
  double background = 0.0;
  double noise = 0.0;         ///< standard deviation
  std::optional<double> low;  ///< given by the operator, else from background and noise
};

/// A component's blobs: one, or two where two markers touch.
using Measured = BoundedVector<Blob, 2>;

inline constexpr int kMaxFits = 128;

/// Measures components on the pixels of their image. One thread; allocates in the constructor only.
///
/// A pixel weighs by a cubic of u, its grey from a little over the dark (0) to the blob's plateau (1). The likelihood
/// asks that the weight's slope at u be the slope of the light at that place over the distance from the middle; the
/// cubic of each radius and width of the edge comes close, and leaves the grid little. The centroid of such weights is
/// the middle of anything symmetric. Discs that the range cuts off, and those parted from another, are fitted.
class BlobMeter {
 public:
  BlobMeter(const DetectKernels& kernels, int grow_px, bool split_touching);

  /// Begins an image: what is measured from now on is of that one. The first kMaxFits saturated discs of an image are
  /// fitted, which costs some microseconds each; further ones get the weighted mean and a sigma that says so.
  void begin_image() { fits_left_ = kMaxFits; }

  /// Asks for the memory of a component that is measured soon.
  void prefetch(const Image& image, const Shape& shape) const;

  /// Measures component `i` of those joined, of that shape and roundness, on the image. What is plain, alone and round,
  /// is only weighed: finish() then tells its blob. To weigh all first lets the processor work on several blobs at
  /// once.
  void measure(const Image& image, const Cut& cut, ImageComponents& components, std::size_t i, const Shape& shape,
               double roundness);

  /// The blobs of component `i`, which was measured.
  Measured finish(const Cut& cut, std::size_t i, const Shape& shape, double roundness) const;

 private:
  struct Window {
    int x, y, width_px, height_px;  // in the image, without what fills the box up
  };

  /// A box, and the sums over it.
  struct Light {
    int middle_x, middle_y;      // of the box, in the image
    int width_px, height_px;     // of the box
    std::uint32_t peak, bright;  // of its pixels
    std::uint32_t at_top;
    std::uint32_t span;
    BoxSums sums;
  };

  struct Weighed {
    Blob blob;
    double radius_px, edge_px;  // of its light
  };

  struct Entry {
    bool is_plain;
    Light light;        // of a plain one
    Measured measured;  // else
  };

  Window window_of(const Image& image, const Shape& shape) const;
  BoxSurvey fetch(const Image& image, const Cut& cut, const Window& window);
  void erase_others(const Cut& cut, std::span<const Run> runs, const Window& window);
  std::uint32_t count_at_top(const Cut& cut, const BoxSurvey& seen) const;
  Light weigh(const Cut& cut, const Window& window, const BoxSurvey& seen) const;
  static Weighed weighed(const Cut& cut, const Light& light, double roundness);
  void refine(const Cut& cut, const Window& window, Weighed& weighed);
  bool fit_side(const Cut& cut, const Window& window, const BoxSurvey& seen, Blob& blob);
  Waist waist_of(const Cut& cut, const Window& window, const Shape& shape) const;
  Measured split(const Cut& cut, const Window& window, const Shape& shape, const Waist& waist);

  const DetectKernels& kernels_;
  int grow_px_;
  bool split_touching_;
  int fits_left_ = kMaxFits;
  std::vector<std::uint16_t> pixels_;
  std::vector<std::uint16_t> saved_;
  std::vector<std::uint8_t> own_;
  std::array<double, 2048> peak_over_;  // the plateau of a disc of so many pixels, in standard deviations
  Box box_;
  std::vector<Entry> entries_;
};

}  // namespace mocap::stages
