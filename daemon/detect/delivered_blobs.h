#pragma once

#include <memory>

#include "module/blob_camera.h"
#include "module/blob_tracker.h"
#include "module/detector.h"

namespace mocap::detect {

/// Gives the blobs that `camera` delivered with its last image. The camera outlives its detectors.
std::unique_ptr<Detector> make_delivered_detector(const BlobCamera& camera);

/// Leaves the delivered 2D tracks as they are.
std::unique_ptr<BlobTracker> make_delivered_tracker();

}  // namespace mocap::detect
