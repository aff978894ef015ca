#pragma once

#include <functional>
#include <span>
#include <vector>

#include "paper_study/clip.h"
#include "paper_study/quality.h"

namespace mocap::paper_study {

inline constexpr int kMultiviewCameras = 4;

struct MultiviewQuality {
  Situation situation;
  int losses = 0;
};

/// Runs the clips of these situations in a volume with four cameras, through the whole pipeline with the daemon's
/// default settings: images, detector, 2D tracks, alignment, matching, triangulation, 3D tracks. The plane of a clip is
/// upright and faces one of the cameras, whose image is about the clip; 1 px is 5 mm. Markers other than the labelled
/// one pass 0.1 to 0.4 m in front of or behind the plane. A barrier is a wall in front of the plane that hides markers
/// from the cameras on its side. The label belongs to the first 3D track that is confirmed on the marker, which must
/// happen by the eighth frame. The label is lost if it is missing in a later frame (zigzags), or if it is more than 75
/// mm (15 px) from its marker in the last frame.
std::vector<MultiviewQuality> judge_multiview(const QualitySettings& settings, std::span<const Situation> situations,
                                              const std::function<void(int done)>& progress);

}  // namespace mocap::paper_study
