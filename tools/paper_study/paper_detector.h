#pragma once

#include <memory>

#include "module/detector.h"

namespace mocap::paper_study {

/// The detector of the study for 8-bit images of one size: a blob is a connected set of pixels with a grey value of at
/// least 230; its position is the unweighted mean of its pixels; its area must be 0.005 % to 0.4 % of the image.
std::unique_ptr<Detector> make_paper_detector(int width_px, int height_px);

}  // namespace mocap::paper_study
