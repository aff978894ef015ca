#include "calibration/floor/walk_positions.h"

namespace mocap::calibration {
namespace {

constexpr std::size_t kMaxPositions = 20000;
constexpr std::uint32_t kMinCameras = 3;

}  // namespace

void WalkPositions::add(const Eigen::Vector3d& at_m, std::uint32_t cameras) {
  if (cameras < kMinCameras || added_++ % step_ != 0) return;
  if (kept_m_.size() == kMaxPositions) {
    for (std::size_t i = 0; i < kMaxPositions / 2; ++i) kept_m_[i] = kept_m_[2 * i];
    kept_m_.resize(kMaxPositions / 2);
    step_ *= 2;
  }
  kept_m_.push_back(at_m);
}

}  // namespace mocap::calibration
