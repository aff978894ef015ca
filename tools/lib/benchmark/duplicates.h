#pragma once

#include <vector>

#include "lib/benchmark/labelled_clip.h"

namespace mocap::benchmark {

/// The points of a clip whose true label is unknown, because the file has their marker twice. Frame after frame, like
/// the positions of the clip.
struct Duplicates {
  std::vector<bool> markers;  ///< by marker of the set
  std::vector<bool> others;   ///< by `LabelledClip::other`
};

/// Finds the markers that the file has twice: with their label, and as a point without a label of the set.
///
/// The centres of two markers are at least a diameter apart. If a point without a label comes nearer to a marker, one
/// of the two was not measured: the labelled position may be the fill of a gap, or the point may be a ghost. Nothing in
/// the file says which. Both are therefore duplicates for as long as the point was visible without a gap.
Duplicates find_duplicates(const LabelledClip& clip);

}  // namespace mocap::benchmark
