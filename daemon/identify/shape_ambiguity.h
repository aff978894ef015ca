#pragma once

#include <optional>
#include <vector>

#include "model/skeleton.h"

namespace mocap::identify {

/// The markers of one thing as they could be read for another's: by marker of the first, the marker of the second.
using MarkerCorrespondence = std::vector<std::size_t>;

/// How all markers of `part` could be taken for markers of `whole`, both of one bone: their places fit onto each other,
/// by turning and moving but not by a mirror, with no marker off by `tolerance_m`. With the same thing twice
/// (`part` is `whole`): how it could be read in another way than it is. Nothing where they cannot, where one has more
/// bones than one, and where `part` has fewer than three markers.
std::optional<MarkerCorrespondence> find_shape_ambiguity(const MarkerSet& part, const MarkerSet& whole,
                                                         double tolerance_m);

/// Whether two bodies of several bones have the same bones and the same markers on them, to `tolerance_m` each.
bool is_same_body(const MarkerSet& a, const MarkerSet& b, double tolerance_m);

}  // namespace mocap::identify
