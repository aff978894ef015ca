#include "filter/condensation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mocap::filter {
namespace {

// Squared Mahalanobis distance of the nearest particle (four standard deviations): beyond it the particles cannot reach
// the measurement by diffusion.
constexpr double kOutOfReach2 = 16.0;

}  // namespace

template <int N>
Condensation<N>::Condensation(const CondensationSettings& settings, const Seen<N>& first)
    : settings_(settings),
      random_(settings.seed),
      count_(static_cast<std::size_t>(std::clamp(settings.particles, 2, kMaxParticles))) {
  scatter(first, Vector<N>::Zero(), settings.initial_speed_u_s);
}

template <int N>
Vector<N> Condensation<N>::normal() {
  Vector<N> v;
  for (int axis = 0; axis < N; ++axis) v[axis] = random_.normal();
  return v;
}

template <int N>
Vector<N> Condensation<N>::nearly_normal() {
  Vector<N> v;
  for (int axis = 0; axis < N; ++axis) v[axis] = random_.nearly_normal();
  return v;
}

template <int N>
void Condensation<N>::scatter(const Seen<N>& around, const Vector<N>& velocity, double velocity_sigma_u_s) {
  const Vector<N> sigma =
      (around.covariance.diagonal().array() + settings_.sighting_u * settings_.sighting_u).sqrt().matrix();
  for (std::size_t i = 0; i < count_; ++i) {
    particles_[i].point = around.point + sigma.cwiseProduct(normal());
    particles_[i].velocity = velocity + velocity_sigma_u_s * normal();
    weights_[i] = 1.0 / static_cast<double>(count_);
  }
  weighted_ = false;
  compute_belief();
}

template <int N>
void Condensation<N>::predict(double dt_s) {
  if (weighted_) select();
  since_seen_s_ += dt_s;
  for (std::size_t i = 0; i < count_; ++i) {
    Particle& particle = particles_[i];
    const Vector<N> change = settings_.acceleration_u_s2 * dt_s * nearly_normal();
    particle.point += (particle.velocity + 0.5 * change) * dt_s;
    particle.velocity += change;
  }
  compute_belief();
}

template <int N>
void Condensation<N>::select() {
  // Systematic resampling: equal steps over the cumulative weights from a random start. The source of particle i may
  // have a lower index than i, so that the old particles are copied first.
  const std::array<Particle, kMaxParticles> old = particles_;
  const double step = 1.0 / static_cast<double>(count_);
  double at = step * random_.unit();
  double sum = weights_[0];
  std::size_t source = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    while (sum < at && source + 1 < count_) sum += weights_[++source];
    particles_[i] = old[source];
    at += step;
  }
  std::fill_n(weights_.begin(), count_, step);
  weighted_ = false;
}

template <int N>
void Condensation<N>::update(const Seen<N>& seen) {
  const Matrix<N> precision =
      (seen.covariance + Matrix<N>::Identity() * settings_.sighting_u * settings_.sighting_u).inverse();
  double total = 0.0;
  double nearest2 = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count_; ++i) {
    const Vector<N> off = seen.point - particles_[i].point;
    const double distance2 = off.dot(precision * off);
    nearest2 = std::min(nearest2, distance2);
    weights_[i] *= std::exp(-0.5 * distance2);
    total += weights_[i];
  }
  const double since_seen_s = std::exchange(since_seen_s_, 0.0);
  if (!(nearest2 < kOutOfReach2) || !(total > 1e-100)) {
    // The velocity changed at an unknown time since the last measurement. The change is 1.5 times the innovation over
    // that time, with a standard deviation of a third of the change.
    const Vector<N> change =
        since_seen_s > 0.0 ? ((seen.point - belief_.point) / since_seen_s).eval() : Vector<N>::Zero();
    scatter(seen, belief_.velocity + 1.5 * change, 0.5 * change.norm());
    return;
  }
  for (std::size_t i = 0; i < count_; ++i) weights_[i] /= total;
  weighted_ = true;
  compute_belief();
}

template <int N>
void Condensation<N>::compute_belief() {
  belief_ = {Vector<N>::Zero(), Vector<N>::Zero(), Matrix<N>::Zero()};
  for (std::size_t i = 0; i < count_; ++i) {
    belief_.point += weights_[i] * particles_[i].point;
    belief_.velocity += weights_[i] * particles_[i].velocity;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    const Vector<N> off = particles_[i].point - belief_.point;
    belief_.covariance += weights_[i] * off * off.transpose();
  }
}

template <int N>
Gate<N> Condensation<N>::gate() const {
  const double wider2 = settings_.sighting_u * settings_.sighting_u + settings_.gate_floor_u * settings_.gate_floor_u;
  return {belief_.point, belief_.covariance + Matrix<N>::Identity() * wider2};
}

template <int N>
void Condensation<N>::archive(Archive& members) {
  members(random_);
  for (std::size_t i = 0; i < count_; ++i) members(particles_[i], weights_[i]);
  members(since_seen_s_, weighted_, belief_);
}

template class Condensation<2>;
template class Condensation<3>;

}  // namespace mocap::filter
