#pragma once

#include <memory>

#include "module/detector.h"

namespace mocap::paper_study {

/// The detector of the study's system, for 8-bit images of one size: pixels of grey 230 or more that touch are a blob;
/// its place is the unweighted mean of its pixels; it counts where its area is 0.005 % to 0.4 % of the image.
std::unique_ptr<Detector> make_paper_detector(int width_px, int height_px);

}  // namespace mocap::paper_study
