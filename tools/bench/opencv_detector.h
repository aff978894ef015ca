#pragma once

#include <memory>

#include "base/result.h"
#include "detect/blob_detector.h"

namespace mocap::bench {

/// The detector as one writes it with OpenCV: threshold, external contours, their moments. What tests and benches
/// compare ours with; not for the daemon. Knows area and centroid only.
///
/// Mono8 alone, and a threshold that is set. Fails with Unsupported or InvalidArgument. Gives no blobs where OpenCV
/// fails.
Result<std::unique_ptr<Detector>> make_opencv_detector(const detect::DetectSettings& settings, PixelFormat format,
                                                       int width_px, int height_px);

}  // namespace mocap::bench
