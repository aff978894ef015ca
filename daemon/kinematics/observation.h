#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "base/archive.h"

namespace mocap::kinematics {

/// A measurement of one labelled marker: a 3D point, or a bearing (a ray of one camera).
struct Observation {
  int marker = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, world
  double sigma_m = 0.005;                              ///< of the measurement and of the marker on the skin
  /// Information matrix, 1/m^2, if the covariance is not isotropic. Zero: isotropic with `sigma_m`.
  Eigen::Matrix3d weight_1_m2 = Eigen::Matrix3d::Zero();
  /// the point may belong to a neighbouring marker: it constrains the pose, but is not used to learn the marker's
  /// offset
  bool is_ambiguous = false;
  /// a ray of one camera: `position` is a point of the ray, with no information along the ray
  bool bearing_only = false;

  void archive(Archive& members) { members(marker, position, sigma_m, weight_1_m2, is_ambiguous, bearing_only); }
};

/// A marker position with covariance. `skin_sigma_m` is the motion of the marker on the skin. A covariance that is not
/// finite or has a negative variance is replaced by an isotropic one of 1 m.
Observation observe_point(int marker, const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance_m2,
                          double skin_sigma_m);

/// A bearing-only observation: a ray from `eye` along `direction` (unit), with standard deviation `sigma_rad` for each
/// axis across it. `near` is a point at about the depth of the marker.
Observation observe_ray(int marker, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, double sigma_rad,
                        const Eigen::Vector3d& near, double skin_sigma_m);

/// Whether all numbers are finite and the standard deviation is positive.
bool is_usable(const Observation& seen);

/// Distance of `place` from the point, m; of a bearing-only observation: from the ray.
double distance_m(const Observation& seen, const Eigen::Vector3d& place);

/// Mean information of the observed directions, 1/m^2: of three directions for a point, of two for a ray.
double information_1_m2(const Observation& seen);

}  // namespace mocap::kinematics
