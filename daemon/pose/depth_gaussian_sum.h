#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "base/archive.h"
#include "base/time.h"

namespace mocap::pose {

/// Tracks the depth of a limb's end along the ray of the only camera that detects it. The ray meets the reach sphere of
/// the limb in two points, at equal distances before and behind the ray's point nearest to the joint; only the square
/// of the depth is measured. Near the tangent point both coincide, and the limb may either pass through to the other
/// branch or turn back. The velocity before and after decides, but not at once.
///
/// The state is depth and velocity. Its density is a sum of four Gaussians: branch (Near, Far) times sign of the
/// velocity. An update splits each component by branch with numerical quadrature over depths; components of the same
/// branch and sign are merged with their moments.
///
/// Source: Alspach and Sorenson, Nonlinear Bayesian Estimation Using Gaussian Sum Approximations (1972).
class DepthGaussianSum {
 public:
  enum Branch { Near = 0, Far = 1 };

  /// Whether this object tracks this ray, and its last commit was less than 0.1 s before `at`.
  bool follows(const Eigen::Vector3d& direction, Timestamp at) const;
  /// Begins a new track at `depth_m`, the depth from the ray's point nearest to the joint along `direction`.
  void begin(Timestamp at, const Eigen::Vector3d& direction, double depth_m);
  /// Computes the state at `at` from the last committed one. `half_chord_m2` is the measured squared depth, negative if
  /// the ray passes outside the sphere; `sigma_m2` is its standard deviation. May be called again for the same instant,
  /// for another hypothesis: the last call counts.
  void update(Timestamp at, const Eigen::Vector3d& direction, double half_chord_m2, double sigma_m2);
  /// Minus the log probability of a branch by the last `update`, between 0 and 10.
  double cost(Branch branch) const;
  /// Makes the last `update` permanent, if it was for this instant.
  void commit(Timestamp at);

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(committed_, updated_, committed_at_, updated_at_, direction_); }

 private:
  struct Component {
    Eigen::Vector2d state = Eigen::Vector2d::Zero();  // depth m, velocity m/s
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    double probability = 0.0;

    void archive(Archive& members) { members(state, covariance, probability); }
  };
  // index: component_index()
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
