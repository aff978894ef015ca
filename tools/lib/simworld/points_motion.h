#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/actor.h"

namespace mocap::simworld {

/// A point that shines: a marker, or a nameless light of a recording.
struct Light {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  bool there = false;                                  ///< false: the recording has a gap here
  bool named = true;                                   ///< false: a nameless light of a recording
};

/// Lights that move: a recording's, worn by as many people as it takes, or a swarm made up.
class PointMotion {
 public:
  virtual ~PointMotion() = default;

  virtual std::size_t light_count() const = 0;
  virtual double length_s() const = 0;
  virtual double rate_hz() const = 0;  ///< of the recording

  /// Where each light is, `t_s` after the beginning; always the same lights in the same order.
  virtual void at(double t_s, std::vector<Light>& into) const = 0;
};

/// The motion of a C3D, BVH or TRC file. `markers` of several people who stand apart and are out of step; 0: those of
/// one. Nameless points of a C3D come with the first. Fails with NotFound, or InvalidArgument with what is wrong.
Result<std::unique_ptr<PointMotion>> load_motion(const std::string& file, std::size_t markers);

/// `markers` that wander about on smooth ways of their own, each up to about 2 m/s.
std::unique_ptr<PointMotion> make_swarm(std::size_t markers, std::uint64_t seed);

}  // namespace mocap::simworld
