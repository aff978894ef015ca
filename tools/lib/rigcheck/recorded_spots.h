#pragma once

#include <vector>

#include "calibration/wand/wand_recording.h"
#include "take/recordings/blob_recording.h"

namespace mocap::rigcheck {

/// The input of calibration: without blobs that touch the image border or that merge several markers.
std::vector<calibration::Picture> spots_of(const std::vector<take::RecordedPicture>& recorded);
calibration::Take spots_of(const take::BlobRecording& recording);

/// The last part of a recording.
calibration::Take last_of(calibration::Take recording, Duration span);

}  // namespace mocap::rigcheck
