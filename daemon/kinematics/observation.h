#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace mocap::kinematics {

/// Where one marker of the set was seen.
struct Observation {
  int marker = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, world
  double sigma_m = 0.005;                              ///< of the measurement and of the skin under it
  /// One over the covariance, 1/m^2, where that is not alike in all directions; nought: as sigma_m tells.
  Eigen::Matrix3d weight_1_m2 = Eigen::Matrix3d::Zero();
  bool is_ambiguous = false;  ///< perhaps of a neighbour: it tells the pose, not where the marker sits
  bool bearing_only = false;  ///< of one camera: `position` is a point of the ray, along which nothing is told
};

/// A marker whose place has a covariance, on skin that strays by `skin_sigma_m`.
Observation observe_point(int marker, const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance_m2,
                          double skin_sigma_m);

/// A marker on a ray from `eye` along `direction` (unit), `sigma_rad` the standard deviation of each axis across it. It
/// is about as far away as `near`.
Observation observe_ray(int marker, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, double sigma_rad,
                        const Eigen::Vector3d& near, double skin_sigma_m);

/// Whether its numbers can be used: all finite, and it tells something.
bool is_usable(const Observation& seen);

/// How far `place` is from it, m; from the ray, of one.
double distance_m(const Observation& seen, const Eigen::Vector3d& place);

/// Of a mean direction across which something is told, 1/m^2.
double information_1_m2(const Observation& seen);

}  // namespace mocap::kinematics
