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

/// The clips of these situations in a volume with four cameras around it, through the whole chain with the daemon's
/// default settings: images, detector, 2D tracks, alignment, matching, triangulation, 3D tracks.
///
/// A clip's plane stands upright in the volume and faces one of the cameras, which sees about the clip; 1 px is 5 mm.
/// Other markers than the labelled one pass 0.1 to 0.4 m before or behind it. A barrier is a wall before the plane: it
/// hides what is behind it from the cameras on its side. The label is the 3D track that is confirmed on the marker
/// first; one must be by the eighth frame. A loss is a later frame without it (zigzags), or the label off its marker in
/// the last frame, by more than 75 mm (15 px).
std::vector<MultiviewQuality> judge_multiview(const QualitySettings& settings, std::span<const Situation> situations,
                                              const std::function<void(int done)>& progress);

}  // namespace mocap::paper_study
