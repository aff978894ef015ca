#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "model/camera_model.h"

namespace mocap::associate {

/// Two cameras, and the epipolar geometry from the first to the second.
struct CameraPair {
  std::uint32_t a, b;
  std::size_t round;
  Eigen::Matrix3d essential;
};

/// All pairs of a rig's cameras, in rounds in each of which a camera has one partner: the best suited first.
class CameraPairSchedule {
 public:
  explicit CameraPairSchedule(const Rig& rig);

  std::size_t size() const { return first_of_round_.size() - 1; }
  std::span<const CameraPair> round(std::size_t i) const {
    return std::span(pairs_).subspan(first_of_round_[i], first_of_round_[i + 1] - first_of_round_[i]);
  }
  std::span<const CameraPair> all() const { return pairs_; }

 private:
  std::vector<CameraPair> pairs_;            // in the order of their rounds
  std::vector<std::size_t> first_of_round_;  // in the pairs; one more at the end
};

}  // namespace mocap::associate
