#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "base/time.h"

namespace mocap::pose {

/// Follows how deep in a camera's view the end of a limb is that this camera alone sees. Its ray meets what the limb
/// reaches in two places, as far before and behind the ray's point nearest to the joint. Where the ray only touches the
/// reach, both are one, and the limb may go through to the other side or turn back: its speed before and after tells,
/// though not at once. So what is known of depth and speed is a sum of Gaussians, one by side and way that it moves;
/// where a place so found may be of either side it is split, and what comes to the same side and way becomes one.
///
/// Source of the scheme: Alspach and Sorenson, Nonlinear Bayesian Estimation Using Gaussian Sum Approximations (1972).
class DepthGaussianSum {
 public:
  enum Branch { Near = 0, Far = 1 };

  /// Whether it followed this ray until a moment before `at`.
  bool follows(const Eigen::Vector3d& direction, Timestamp at) const;
  /// The limb was at this depth (m, from the ray's point nearest to the joint, along `direction`).
  void begin(Timestamp at, const Eigen::Vector3d& direction, double depth_m);
  /// One instant: the square of how far both places are from the ray's nearest point, below 0 where the ray passes
  /// outside, and that square's sigma, both m^2. May be asked again for the same instant, by another reading.
  void update(Timestamp at, const Eigen::Vector3d& direction, double half_chord_m2, double sigma_m2);
  /// By the last `update`: how unlikely this side is, minus the logarithm of its share, at most 10.
  double cost(Branch branch) const;
  /// Takes the last `update` for true, if it was of this instant.
  void commit(Timestamp at);

 private:
  struct Component {
    Eigen::Vector2d state = Eigen::Vector2d::Zero();  // m, m/s
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    double probability = 0.0;
  };
  // By side, on either of which they move before and behind.
  using Components = std::array<Component, 4>;

  static std::size_t component_index(Branch branch, double speed_m_s);
  static Component initial_component(double depth_m, double probability);
  static double probability_of(Branch branch, const Components& components);
  void reinitialise(double half_chord_m);
  static Component predict_component(const Component& component, double step_s);
  static std::array<Component, 2> split_by_measurement(const Component& component, double half_chord_m2,
                                                       double sigma_m2);
  static void merge(const Component& component, Component& to);

  Components committed_;
  Components updated_;
  Timestamp committed_at_;
  Timestamp updated_at_;
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();
};

}  // namespace mocap::pose
