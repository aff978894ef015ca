#pragma once

#include <optional>
#include <vector>

#include "model/skeleton.h"

namespace mocap::identify {

/// By marker of one rigid body, the marker of another rigid body with which it can be confused.
using MarkerCorrespondence = std::vector<std::size_t>;

/// Finds an assignment of all markers of `part` to markers of `whole` under which a rotation and translation (no
/// mirror image) moves each marker to within `tolerance_m` of its counterpart. If `part` and `whole` are the same
/// object, the identity is excluded: the result is a symmetry of the body.
///
/// Nothing if no such assignment exists, if a set has more than one bone, or if `part` has fewer than three
/// markers or more than `whole`.
std::optional<MarkerCorrespondence> find_shape_ambiguity(const MarkerSet& part, const MarkerSet& whole,
                                                         double tolerance_m);

/// Whether two bodies have the same bones and markers, with offsets that differ by at most `tolerance_m` each.
bool is_same_body(const MarkerSet& a, const MarkerSet& b, double tolerance_m);

}  // namespace mocap::identify
