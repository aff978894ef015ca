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
/// A component is a set of 8-connected bright pixels without the masked ones. The component's centroid is weighted by
/// intensity, from the low threshold to the component's own plateau, over its box grown by `grow_px`, without the light
/// of its neighbours. Automatic thresholds follow from background and noise, which are estimated at sampled places of
/// each image. The same image gives the same blobs on every processor. Blobs are in the order of their first pixel, row
/// by row; a component with a waist is two blobs. An image with fewer bytes than its size and stride require gives no
/// blobs.
///
/// `sigma_px` is the standard deviation of the centroid from the image's noise, with a floor for the pixel grid. A blob
/// that is cut by the border or a mask, or split from another blob, has additional variance.
///
/// Noise storms: a row is dropped if more than 3/4 of its words of 64 pixels (and more than 4) have bright pixels and
/// it has more than one run per 40 pixels (and more than 32). The rest of a quarter of the image's height is dropped
/// when that quarter has more than one run per 160 pixels (and more than 8192). Dropped rows are counted.
///
/// Formats: all but Mjpeg, which fails with Unsupported (cameras deliver decoded images). Fails with InvalidArgument
/// for sizes outside 1 to 32767 and for settings outside their ranges. `kernels` selects the kernels in tests and
/// benches; without it, the fastest kernels of this processor are used.
Result<std::unique_ptr<Detector>> make_blob_detector(const DetectSettings& settings, PixelFormat format, int width_px,
                                                     int height_px, std::span<const MaskPolygon> masks = {},
                                                     const DetectKernels* kernels = nullptr);

}  // namespace mocap::detect
