#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mocap::calibration {

/// Positions of markers over a walk: every n-th one, so that at most 20000 are kept, evenly over the whole walk.
class WalkPositions {
 public:
  /// Adds a position, m, that `cameras` cameras see. One that fewer than three see may be a ghost and is left out.
  void add(const Eigen::Vector3d& at_m, std::uint32_t cameras);

  const std::vector<Eigen::Vector3d>& positions() const noexcept { return kept_m_; }

 private:
  std::vector<Eigen::Vector3d> kept_m_;  // every step_-th one
  std::size_t step_ = 1;
  std::size_t added_ = 0;
};

}  // namespace mocap::calibration
