#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/camera_model.h"

namespace mocap::associate {

/// Two cameras and their essential matrix, which maps a ray of `a` to its epipolar line in `b`.
struct CameraPair {
  std::uint32_t a, b;
  std::size_t round;
  Eigen::Matrix3d essential;
};

/// All camera pairs of a rig in rounds. In a round each camera has at most one partner. The most suitable pairs come
/// first: their cameras see the centre of the volume from about 60 degrees apart.
class CameraPairSchedule {
 public:
  explicit CameraPairSchedule(const Rig& rig);

  /// The number of rounds, and the pairs of one round.
  std::size_t size() const { return first_of_round_.size() - 1; }
  std::span<const CameraPair> round(std::size_t i) const {
    return std::span(pairs_).subspan(first_of_round_[i], first_of_round_[i + 1] - first_of_round_[i]);
  }
  std::span<const CameraPair> all() const { return pairs_; }

 private:
  std::vector<CameraPair> pairs_;            // in the order of the rounds
  std::vector<std::size_t> first_of_round_;  // index in pairs_; one more element at the end
};

}  // namespace mocap::associate
