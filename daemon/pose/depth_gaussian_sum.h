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
class RayDepth {
 public:
  enum Side { Before = 0, Behind = 1 };

  /// Whether it followed this ray until a moment before `at`.
  bool follows(const Eigen::Vector3d& direction, Timestamp at) const;
  /// The limb was at this depth (m, from the ray's point nearest to the joint, along `direction`).
  void begin(Timestamp at, const Eigen::Vector3d& direction, double depth_m);
  /// One instant: the square of how far both places are from the ray's nearest point, below 0 where the ray passes
  /// outside, and that square's sigma, both m^2. May be asked again for the same instant, by another reading.
  void weigh(Timestamp at, const Eigen::Vector3d& direction, double half2_m2, double sigma_m2);
  /// By the last `weigh`: how unlikely this side is, minus the logarithm of its share, at most 10.
  double cost(Side side) const;
  /// Takes the last `weigh` for true, if it was of this instant.
  void learn(Timestamp at);

 private:
  struct Part {
    Eigen::Vector2d state = Eigen::Vector2d::Zero();  // m, m/s
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    double share = 0.0;
  };
  // By side, on either of which they move before and behind.
  using Parts = std::array<Part, 4>;

  static std::size_t slot_of(Side side, double speed_m_s);
  static Part begun_at(double depth_m, double share);
  static double share_of(Side side, const Parts& parts);
  void begin_anew(double half_m);
  static Part led_on(const Part& part, double step_s);
  static std::array<Part, 2> met(const Part& part, double half2_m2, double sigma_m2);
  static void add(const Part& part, Part& to);

  Parts learnt_;
  Parts weighed_;
  Timestamp learnt_at_;
  Timestamp weighed_at_;
  Eigen::Vector3d direction_ = Eigen::Vector3d::Zero();
};

}  // namespace mocap::pose
