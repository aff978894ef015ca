#pragma once

#include <memory>
#include <span>

#include "base/result.h"
#include "detect/detect_settings.h"
#include "model/frame.h"
#include "model/image_mask.h"
#include "module/detector.h"

namespace mocap::detect {

struct DetectKernels;

/// Makes the detector for images of one format and size.
///
/// Bright pixels that touch (8-connected) are a component, less what is masked. Its centroid is weighted by intensity
/// from the low threshold to its own plateau, over its box grown by `grow_px`, less what is a neighbour's. Where
/// thresholds come from noise, background and noise are read from a few places of each image: the same image gives the
/// same blobs, on every processor. Blobs come in the order of their first pixel, row by row; a component with a waist
/// is two blobs. An image that is smaller than its size and stride say gives none.
///
/// `sigma_px` is the standard deviation that the image's noise gives the centroid, with a floor for the pixel grid; a
/// blob cut by the border or a mask, or parted from another, knows its place less well, which is added.
///
/// A row with bright pixels all over it, in more than three of four words of 64 pixels (and 4), and with more than a
/// run for every 40 pixels (and 32), is noise; so is what is left of a quarter of the image's height that has used up
/// its share of a run for every 160 pixels (and 8192). Such rows are given up and counted.
///
/// Formats: all but Mjpeg, which fails with Unsupported (cameras hand it on decoded). Fails with InvalidArgument for
/// sizes outside of 1 to 32767 and settings outside of their ranges. `kernels` are for tests and benches; the fastest
/// are taken where there are none.
Result<std::unique_ptr<Detector>> make_blob_detector(const DetectSettings& settings, PixelFormat format, int width_px,
                                                     int height_px, std::span<const MaskPolygon> masks = {},
                                                     const DetectKernels* kernels = nullptr);

}  // namespace mocap::detect
