#pragma once

#include <array>
#include <cstdint>

#include "base/archive.h"
#include "filter/point_filter.h"
#include "filter/random.h"

namespace mocap::filter {

inline constexpr int kMaxParticles = 256;

/// u is the unit of length: px in an image, m in the volume.
struct CondensationSettings {
  int particles = 100;              ///< 2 to kMaxParticles
  double acceleration_u_s2 = 10.0;  ///< standard deviation of the acceleration, each axis
  double initial_speed_u_s = 1.0;   ///< standard deviation of the velocity of a new track, each axis
  /// standard deviation added to that of a measurement: with few particles, none is near a precise measurement
  double sighting_u = 1.0;
  double gate_floor_u = 0.0;  ///< standard deviation added to the gate
  std::uint64_t seed = 1;
};

/// Particle filter (CONDENSATION): particles with position and velocity are selected by weight, predicted with noise,
/// and weighted by the likelihood of the measurement.
///
/// Equal seeds and measurements give equal states. If a measurement is far from all particles, the particles are
/// sampled anew around it, with the velocity that the jump implies.
///
/// Source: Isard and Blake, "CONDENSATION - conditional density propagation for visual tracking", Int. J. Computer
/// Vision 29 (1998), figure 5; systematic selection: Kitagawa, J. Computational and Graphical Statistics 5 (1996),
/// appendix.
template <int N>
class Condensation {
 public:
  Condensation(const CondensationSettings& settings, const Seen<N>& first);

  void predict(double dt_s);
  Gate<N> gate() const;
  void update(const Seen<N>& seen);
  void coast() {}  // diffusion alone spreads the particles
  /// Samples all particles anew around this state.
  void restart(const Seen<N>& point, const Vector<N>& velocity, double velocity_sigma_u_s) {
    scatter(point, velocity, velocity_sigma_u_s);
  }
  Belief<N> belief() const { return belief_; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  struct Particle {
    Vector<N> point;
    Vector<N> velocity;

    void archive(Archive& members) { members(point, velocity); }
  };

  void scatter(const Seen<N>& around, const Vector<N>& velocity, double velocity_sigma_u_s);
  void select();
  void compute_belief();
  Vector<N> normal();
  Vector<N> nearly_normal();

  CondensationSettings settings_;
  Random random_;
  std::size_t count_;
  std::array<Particle, kMaxParticles> particles_;
  std::array<double, kMaxParticles> weights_;  // sum: 1
  double since_seen_s_ = 0.0;
  bool weighted_ = false;  // a measurement has changed the weights since the last selection
  Belief<N> belief_;
};

extern template class Condensation<2>;
extern template class Condensation<3>;

}  // namespace mocap::filter
