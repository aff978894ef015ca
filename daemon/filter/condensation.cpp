#include "filter/condensation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace mocap::filter {

template <int N>
Condensation<N>::Condensation(const CondensationSettings& settings, const Seen<N>& first)
    : settings_(settings),
      random_(settings.seed),
      count_(static_cast<std::size_t>(std::clamp(settings.particles, 2, kMaxParticles))) {
  scatter(first, Vector<N>::Zero(), settings.birth_speed_u_s);
}

template <int N>
Vector<N> Condensation<N>::normal() {
  Vector<N> v;
  for (int axis = 0; axis < N; ++axis) v[axis] = random_.normal();
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
  sum_up();
}

template <int N>
void Condensation<N>::predict(double dt_s) {
  if (weighted_) select();
  for (std::size_t i = 0; i < count_; ++i) {
    Particle& particle = particles_[i];
    const Vector<N> change = settings_.acceleration_u_s2 * dt_s * normal();
    particle.point += (particle.velocity + 0.5 * change) * dt_s;
    particle.velocity += change;
  }
  sum_up();
}

template <int N>
void Condensation<N>::select() {
  // Systematic: equal steps over the summed weights from a random start. Particle i of the new set stems from one of
  // the old whose index is not known to be below i, so the old set is copied.
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
  for (std::size_t i = 0; i < count_; ++i) {
    const Vector<N> off = seen.point - particles_[i].point;
    weights_[i] *= std::exp(-0.5 * off.dot(precision * off));
    total += weights_[i];
  }
  if (!(total > 1e-100)) {
    scatter(seen, belief_.velocity, settings_.birth_speed_u_s);
    return;
  }
  for (std::size_t i = 0; i < count_; ++i) weights_[i] /= total;
  weighted_ = true;
  sum_up();
}

template <int N>
void Condensation<N>::sum_up() {
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

template class Condensation<2>;
template class Condensation<3>;

}  // namespace mocap::filter
