#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>

#include "base/archive.h"
#include "filter/alpha_beta.h"
#include "filter/condensation.h"
#include "filter/isotropic_kalman.h"
#include "filter/kalman.h"

namespace mocap::filter {
namespace archive_test {

constexpr double kStep_s = 0.01;

// A point on a circle, with noise.
Seen<3> seen_at(int step, Random& random) {
  const double t = kStep_s * step;
  const Vector<3> noise(random.normal(), random.normal(), random.normal());
  return {Vector<3>(std::cos(5.0 * t), std::sin(5.0 * t), t) + 0.01 * noise, 1e-4 * Matrix<3>::Identity()};
}

// IsotropicKalman with the calls of the other filters.
struct Isotropic {
  IsotropicKalman<3> filter;

  void predict(double dt_s) { filter.predict(dt_s); }
  void update(const Seen<3>& seen) { filter.update(seen.point, seen.covariance(0, 0)); }
  void coast() { filter.coast(); }
  Belief<3> belief() const {
    const Motion<3>& motion = filter.motion();
    return {motion.point, motion.velocity, Vector<3>(motion.pp, motion.pv, motion.vv).asDiagonal()};
  }
  void archive(Archive& members) { members(filter); }
};

// Two measurements, then two steps without one.
template <class F>
void advance(F& filter, int step, Random& random) {
  filter.predict(kStep_s);
  const Seen<3> seen = seen_at(step, random);
  step % 4 >= 2 ? filter.coast() : filter.update(seen);
}

template <class F>
void expect_equal_beliefs(const F& one, const F& other, int step) {
  Belief<3> a = one.belief(), b = other.belief();
  std::array<std::byte, 512> bytes_a{}, bytes_b{};
  Archive members_a = Archive::writer(bytes_a), members_b = Archive::writer(bytes_b);
  members_a(a);
  members_b(b);
  ASSERT_TRUE(members_a.ok());
  EXPECT_EQ(bytes_a, bytes_b) << step;
}

// The belief is read between two steps without a measurement.
template <class F>
void expect_continues(F filter, F other) {
  Random random(3);
  for (int step = 0; step < 35; ++step) advance(filter, step, random);
  std::array<std::byte, 32768> bytes{};
  Archive writer = Archive::writer(bytes), reader = Archive::reader(bytes);
  filter.archive(writer);
  other.archive(reader);
  ASSERT_TRUE(writer.ok() && reader.ok());
  EXPECT_EQ(writer.size(), reader.size());

  Random other_random = random;
  for (int step = 35; step < 100; ++step) {
    advance(filter, step, random);
    advance(other, step, other_random);
    expect_equal_beliefs(filter, other, step);
  }
}

const Seen<3> kFirst{Vector<3>(1.0, 0.0, 0.0), 1e-4 * Matrix<3>::Identity()};
const Seen<3> kElsewhere{Vector<3>(-3.0, 2.0, 1.0), Matrix<3>::Identity()};

TEST(Archive, LetsAnAlphaBetaFilterContinue) {
  const AlphaBetaSettings settings{.gate_per_speed = 1.0, .gate_per_miss_u = 0.5};
  expect_continues(AlphaBeta<3>(settings, kFirst), AlphaBeta<3>(settings, kElsewhere));
}

TEST(Archive, LetsAKalmanFilterContinue) {
  const KalmanSettings settings{.acceleration_per_speed = 0.5, .max_noise_scale = 9.0, .coast_half_life_s = 0.1};
  expect_continues(Kalman<3>(settings, kFirst), Kalman<3>(settings, kElsewhere));
}

TEST(Archive, LetsAnIsotropicKalmanFilterContinue) {
  const IsotropicKalmanSettings settings;
  expect_continues(Isotropic{{settings, kFirst.point, 1e-4}}, Isotropic{{settings, kElsewhere.point, 1.0}});
}

TEST(Archive, LetsAParticleFilterContinue) {
  expect_continues(Condensation<3>({}, kFirst), Condensation<3>({.seed = 7}, kElsewhere));
}

}  // namespace archive_test
}  // namespace mocap::filter
