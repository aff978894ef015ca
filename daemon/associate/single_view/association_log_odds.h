#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "associate/predicted/merged_blob_resolver.h"
#include "associate/rays/view_rays.h"
#include "model/sighting.h"

namespace mocap::associate {

/// The blob of one of two views that may have observed a marker.
struct ViewObservation {
  Eigen::Matrix<double, 2, 3> px_from_m;  ///< derivative of the projection by the point
  Eigen::Vector2d off_px;                 ///< from the projection of the triangulated point to the blob
  double sigma_px = 1.0;                  ///< of blob and rig together, each axis; positive
  double clutter_density_1_px2 = 1.0;     ///< density of false blobs, per px^2; positive
};

/// The observation of a view's assigned ray, relative to the triangulated point of a pair. `rig_px`: standard deviation
/// of the rig error.
///
/// The clutter density is the mean density of unassigned rays over the image plus the local density near the blob; near
/// a shared blob all rays count.
ViewObservation view_observation(const ViewRays& view, const AssignedRay& assigned, const WorldPoint& point,
                                 double rig_px);

/// The natural log odds that both blobs are views of the marker, against the most likely alternative: one or both are
/// clutter (ratio of Gaussian innovation density and clutter density; Bar-Shalom and Fortmann 1988).
///
/// `ahead_m` leads from the triangulated point to the predicted position, which has this covariance. The joint density
/// of both innovations includes their correlation: with two views, only the epipolar distance and the depth show
/// whether both blobs are the same marker.
double pair_log_odds(const ViewObservation& a, const ViewObservation& b, const Eigen::Vector3d& ahead_m,
                     const Eigen::Matrix3d& covariance_m2);

/// The natural log odds that the only ray of a predicted marker is a view of the marker, against clutter; minus
/// infinity if the marker is not in front of the camera.
double single_view_log_odds(const ViewRays& view, std::size_t ray, const PredictedMarker& predicted, double rig_px);

}  // namespace mocap::associate
