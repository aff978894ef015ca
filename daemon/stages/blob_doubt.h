#pragma once

#include <span>

#include "model/blob.h"

namespace mocap::stages {

/// How well a blob tells where the marker is, px, each axis: its own sigma_px, and what its shape casts doubt on.
///
/// Where two markers overlap in an image, or nearly touch, they are one blob, whose centroid lies between them. Of two
/// like discs that lie 2 d apart the inertia along exceeds that across by d^2, so that area and roundness tell d, which
/// is how far the centroid is off either marker. A lone marker is a disc but for the pixels' grid.
double doubt_px(const Blob& blob);
/// The same, where its `spread_px` is known.
double doubt_px(const Blob& blob, double spread_px);

/// How far off the centroid of a blob may be that is much larger than the blobs of lone markers in its image; 0 where
/// it is not. A crowd of three or more may be as round as one.
double crowd_px(const Blob& blob, double usual_area_px2);

/// Whether any of the blobs can be such a crowd, whichever is the usual area: where none is much larger than the
/// smallest, nobody needs to know it.
bool may_crowd(std::span<const double> areas_px2);

/// How far the markers of a merged blob lie from its centroid, px, root of the mean square, as far as its shape tells;
/// 0 for a blob that is as round as a lone marker's.
double spread_px(const Blob& blob);

}  // namespace mocap::stages
