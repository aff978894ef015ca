#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "scene/actor.h"

namespace mocap::simworld {

/// A bright point: a marker, or an unlabelled point of a recording.
struct Light {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m
  bool there = false;                                  ///< false in a gap of the recording
  bool is_labelled = true;                             ///< false: an unlabelled point of a recording
};

/// Moving lights: copies of a recording, or a random swarm.
class PointMotion {
 public:
  virtual ~PointMotion() = default;

  virtual std::size_t light_count() const = 0;
  virtual double length_s() const = 0;
  virtual double rate_hz() const = 0;  ///< of the recording

  /// Replaces `into` with all lights at time `t_s` since the start. Number and order of the lights never change.
  virtual void at(double t_s, std::vector<Light>& into) const = 0;
};

/// Loads the motion of a C3D, BVH or TRC file. Copies the recorded person, displaced in space and time, until there are
/// `markers` markers; 0: one person. The unlabelled points of a C3D file are added once. Fails with NotFound, or with
/// InvalidArgument and the reason.
Result<std::unique_ptr<PointMotion>> load_motion(const std::string& file, std::size_t markers);

/// A swarm of `markers` markers on independent smooth paths with speeds up to about 2 m/s.
std::unique_ptr<PointMotion> make_swarm(std::size_t markers, std::uint64_t seed);

}  // namespace mocap::simworld
