#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "base/key_visitor.h"

namespace mocap::associate {

/// [match]: the views of one marker across cameras. Help, units and ranges: the table in match_settings.cpp.
struct MatchSettings {
  double gate_sigmas = 4.0;
  double gate_floor_px = 1.0;
  double calibration_px = 0.5;
  double agree_sigmas = 3.5;
  std::uint32_t min_views_new = 3;
  double min_ray_angle_deg = 2.0;
  Eigen::Vector3d volume_min_m{-20.0, -20.0, -1.0};
  Eigen::Vector3d volume_max_m{20.0, 20.0, 10.0};

  bool in_volume(const Eigen::Vector3d& point) const {
    return (point.array() >= volume_min_m.array()).all() && (point.array() <= volume_max_m.array()).all();
  }
};

void declare_keys(KeyVisitor& keys, MatchSettings& match);

/// Returns the rules between several keys that the settings break.
std::vector<KeyFault> faults_of(const MatchSettings& match);

}  // namespace mocap::associate
