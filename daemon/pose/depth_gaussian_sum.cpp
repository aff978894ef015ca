#include "pose/depth_gaussian_sum.h"

#include <algorithm>
#include <cmath>

#include "kinematics/algebra.h"

namespace mocap::pose {
namespace {

using kinematics::squared;

// A ray in another direction belongs to another camera. After a longer gap the velocity carries no information. Chosen
// by hand; not yet measured.
constexpr double kMinSameRayCosine = 0.9;
constexpr double kMaxDepthGap_s = 0.1;
// Standard deviations of the initial depth and velocity. Chosen by hand; not yet measured.
constexpr double kInitialDepthSigma_m = 0.01;
constexpr double kInitialSpeedSigma_m_s = 1.0;
// White-noise acceleration: the velocity of a hand changes by 0.1 m/s (one standard deviation) from set to set at 120
// Hz. Chosen by hand; not yet measured.
constexpr double kAccelerationNoise_m2_s3 = 1.0;
// Resolution of the depth; number of quadrature points and their span in standard deviations. Chosen by hand; not yet
// measured.
constexpr double kMinDepthSigma_m = 3e-4;
constexpr int kQuadraturePoints = 33;
constexpr double kQuadratureSigmas = 3.0;
// A measurement less likely than this shows that the velocity jumped. Chosen by hand; not yet measured.
constexpr double kMinLikelihood = 1e-8;
// Bounds that keep each branch possible. Chosen by hand; not yet measured.
constexpr double kMinProbability = 1e-6;
constexpr double kMaxBranchCost = 10.0;

}  // namespace

bool DepthGaussianSum::follows(const Eigen::Vector3d& direction, Timestamp at) const {
  return direction_.dot(direction) > kMinSameRayCosine && to_s(at - committed_at_) < kMaxDepthGap_s &&
         at >= committed_at_;
}

void DepthGaussianSum::begin(Timestamp at, const Eigen::Vector3d& direction, double depth_m) {
  direction_ = direction;
  committed_at_ = updated_at_ = at;
  committed_.fill({});
  committed_[component_index(depth_m < 0.0 ? Near : Far, 0.0)] = initial_component(depth_m, 1.0);
  updated_ = committed_;
}

DepthGaussianSum::Component DepthGaussianSum::initial_component(double depth_m, double probability) {
  return {{depth_m, 0.0},
          Eigen::Vector2d(squared(kInitialDepthSigma_m), squared(kInitialSpeedSigma_m_s)).asDiagonal(),
          probability};
}

std::size_t DepthGaussianSum::component_index(Branch branch, double speed_m_s) {
  return 2 * static_cast<std::size_t>(branch) + (speed_m_s < 0.0 ? 0 : 1);
}

DepthGaussianSum::Component DepthGaussianSum::predict_component(const Component& component, double step_s) {
  Eigen::Matrix2d transition, process_noise;
  transition << 1.0, step_s, 0.0, 1.0;
  process_noise << squared(step_s) / 3.0, step_s / 2.0, step_s / 2.0, 1.0;
  return {
      transition * component.state,
      transition * component.covariance * transition.transpose() + kAccelerationNoise_m2_s3 * step_s * process_noise,
      component.probability};
}

// Updates one component with the measured squared depth. Returns one component for each branch, weighted by its
// likelihood. Near depth 0 the square has no useful linearisation, so the moments are sums over depths (quadrature).
// The velocity follows the depth through the component's covariance.
std::array<DepthGaussianSum::Component, 2> DepthGaussianSum::split_by_measurement(const Component& component,
                                                                                  double half_chord_m2,
                                                                                  double sigma_m2) {
  const double sigma_m = std::sqrt(component.covariance(0, 0));
  const double step_m = 2.0 * kQuadratureSigmas * sigma_m / (kQuadraturePoints - 1);
  std::array<Eigen::Vector3d, 2> moments{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  for (int i = 0; i < kQuadraturePoints; ++i) {
    const double off_m = i * step_m - kQuadratureSigmas * sigma_m;
    const double depth_m = component.state.x() + off_m;
    const double off_m2 = half_chord_m2 - squared(depth_m);
    const double weight = std::exp(-0.5 * (squared(off_m / sigma_m) + squared(off_m2 / sigma_m2)));
    moments[depth_m < 0.0 ? Near : Far] += weight * Eigen::Vector3d(1.0, off_m, squared(off_m));
  }
  const Eigen::Vector2d gain = component.covariance.col(0) / component.covariance(0, 0);
  std::array<Component, 2> found;
  for (const Branch branch : {Near, Far}) {
    const double weight = moments[branch][0];
    if (!(weight > 0.0)) continue;
    const double off_m = moments[branch][1] / weight;
    const double variance_m2 = std::max(squared(0.1 * kMinDepthSigma_m), moments[branch][2] / weight - squared(off_m));
    found[branch] = {component.state + gain * off_m,
                     component.covariance + (variance_m2 - component.covariance(0, 0)) * gain * gain.transpose(),
                     component.probability * weight / kQuadraturePoints};
  }
  return found;
}

// Merges two components into one with the same mean and covariance.
void DepthGaussianSum::merge(const Component& component, Component& to) {
  const double probability = to.probability + component.probability;
  if (!(probability > 0.0)) return;
  const double weight = component.probability / probability;
  const Eigen::Vector2d difference = component.state - to.state;
  to.covariance = ((1.0 - weight) * to.covariance + weight * component.covariance +
                   weight * (1.0 - weight) * difference * difference.transpose())
                      .eval();
  to.state += weight * difference;
  to.probability = probability;
}

void DepthGaussianSum::update(Timestamp at, const Eigen::Vector3d& direction, double half_chord_m2, double sigma_m2) {
  updated_at_ = at;
  direction_ = direction;
  const double finest_m2 = std::max(sigma_m2, 2.0 * kMinDepthSigma_m * std::sqrt(std::max(0.0, half_chord_m2)));
  updated_.fill({});
  for (const Component& component : committed_) {
    if (!(component.probability > 0.0)) continue;
    const std::array<Component, 2> found =
        split_by_measurement(predict_component(component, to_s(at - committed_at_)), half_chord_m2, finest_m2);
    for (const Branch branch : {Near, Far})
      merge(found[branch], updated_[component_index(branch, found[branch].state.y())]);
  }
  double total = 0.0;
  for (const Component& component : updated_) total += component.probability;
  if (total < kMinLikelihood) {
    reinitialise(std::sqrt(std::max(0.0, half_chord_m2)));
    return;
  }
  for (Component& component : updated_) {
    if (component.probability > 0.0) component.probability = std::max(kMinProbability, component.probability / total);
  }
}

// Restarts both branches at the measured depth, with their probabilities kept and the velocity unknown.
void DepthGaussianSum::reinitialise(double half_chord_m) {
  const std::array<double, 2> probabilities{probability_of(Near, committed_), probability_of(Far, committed_)};
  updated_.fill({});
  for (const Branch branch : {Near, Far}) {
    if (probabilities[branch] > 0.0)
      updated_[component_index(branch, 0.0)] =
          initial_component(branch == Near ? -half_chord_m : half_chord_m, probabilities[branch]);
  }
}

double DepthGaussianSum::probability_of(Branch branch, const Components& components) {
  return components[component_index(branch, -1.0)].probability + components[component_index(branch, 1.0)].probability;
}

double DepthGaussianSum::cost(Branch branch) const {
  const double probability = probability_of(branch, updated_);
  return std::clamp(-std::log(probability), 0.0, kMaxBranchCost);
}

void DepthGaussianSum::commit(Timestamp at) {
  if (updated_at_ != at) return;
  committed_ = updated_;
  committed_at_ = at;
}

}  // namespace mocap::pose
