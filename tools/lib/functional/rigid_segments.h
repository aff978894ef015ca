#pragma once

#include <cstddef>
#include <vector>

#include "bodyfit/fit_subject.h"

namespace mocap::functional {

struct SegmentSettings {
  /// Largest standard deviation of the distance of any two markers of a segment. Skin moves by some millimetres, and
  /// joints change distances by centimetres (decision 0001).
  double max_deviation_m = 0.010;
  std::size_t min_frames = 50;  ///< frames that must show two markers of one segment; all of a shorter take
};

/// Markers of one rigid part of the body, by index, ascending.
using Segment = std::vector<std::size_t>;

/// Groups the markers of a take by their mutual distances: those of a rigid part are constant. Complete-linkage
/// clustering, so that every pair of a segment keeps its distance. The hundredth of the distances of a pair that
/// deviates most is left out, because labels of recordings contain exchanges. Segments are in the order of their first
/// markers; each marker is in exactly one.
///
/// The measure is that of Kirk, O'Brien and Forsyth, "Skeletal Parameter Estimation from Optical Motion Capture Data"
/// (CVPR 2005), section 3, which clusters spectrally.
std::vector<Segment> find_rigid_segments(const bodyfit::LabelledTake& take, const SegmentSettings& settings);

}  // namespace mocap::functional
