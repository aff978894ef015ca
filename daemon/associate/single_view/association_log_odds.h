#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "associate/predicted/merged_blob_resolver.h"
#include "associate/rays/view_rays.h"
#include "model/sighting.h"

namespace mocap::associate {

/// What one of two views says of a marker that it may have seen.
struct ViewObservation {
  Eigen::Matrix<double, 2, 3> px_from_m;  ///< how the image moves with the point
  Eigen::Vector2d off_px;                 ///< from where the camera would see the point of the pair to the blob
  double sigma_px = 1.0;                  ///< of the blob's place and the rig together, each axis; over 0
  double clutter_density_1_px2 = 1.0;     ///< blobs of something else to reckon with, per px^2; over 0
};

/// Of what the view holds of a marker, seen from the point of the pair. `rig_px`: what a view may be off.
///
/// Blobs of something else are reckoned with as the rays that no marker has lie all over the image and, where there are
/// more, near the blob; near a blob that other markers share all rays count.
ViewObservation view_observation(const ViewRays& view, const AssignedRay& assigned, const WorldPoint& point,
                                 double rig_px);

/// How much likelier it is that both blobs are the marker's than that one is and the other something else's, or that
/// both are something else's: natural logarithm, against the likeliest of these.
///
/// `ahead_m` leads from the point of the pair to where the marker was expected, with that covariance. What a blob says
/// is weighed against where it should be after what the other says: of two views only the distance from each other's
/// epipolar line and the depth tell whether they belong together.
double pair_log_odds(const ViewObservation& a, const ViewObservation& b, const Eigen::Vector3d& ahead_m,
                     const Eigen::Matrix3d& covariance_m2);

/// How much likelier it is that a ray, the only one that an expected marker has, is the marker's than something else's;
/// natural logarithm.
double single_view_log_odds(const ViewRays& view, std::size_t ray, const ExpectedMarker& expected, double rig_px);

}  // namespace mocap::associate
