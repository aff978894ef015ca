#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace mocap::scene {

/// A hash of a number. Source: Steele, Lea, Flood, "Fast splittable pseudorandom number generators" (2014), the
/// finaliser of SplitMix64.
constexpr std::uint64_t mixed(std::uint64_t x) noexcept {
  x += 0x9E37'79B9'7F4A'7C15;
  x = (x ^ (x >> 30)) * 0xBF58'476D'1CE4'E5B9;
  x = (x ^ (x >> 27)) * 0x94D0'49BB'1331'11EB;
  return x ^ (x >> 31);
}

/// Random numbers that are the same on every machine, unlike the distributions of the standard library.
class Random {
 public:
  explicit Random(std::uint64_t seed) noexcept : state_(mixed(seed)) {}

  std::uint64_t bits() noexcept { return mixed(state_++); }
  /// Uniform in [0, 1).
  double uniform() noexcept { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  /// Standard normal, by Box and Muller.
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace mocap::scene
