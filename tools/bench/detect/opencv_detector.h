#pragma once

#include <memory>

#include "base/result.h"
#include "detect/blob_detector.h"

namespace mocap::bench {

/// Creates a reference detector with OpenCV for tests and benches: threshold, external contours, moments. Its blobs
/// have only area and centroid. Fails with Unsupported if the format is not Mono8, and with InvalidArgument if the
/// settings have no threshold. The detector returns no blobs if OpenCV fails.
Result<std::unique_ptr<Detector>> make_opencv_detector(const detect::DetectSettings& settings, PixelFormat format,
                                                       int width_px, int height_px);

}  // namespace mocap::bench
