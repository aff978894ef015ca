#include "bench/solve/solve_reference.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>
#include <vector>

namespace mocap::bench {
namespace {

constexpr int kStride = 8;  // derivatives computed together

// Residuals of all markers: position in the pose minus measured position.
struct Residuals {
  const MarkerSet* marker_set;
  const std::vector<WorldPoint>* seen;

  // parameters[0]: position of the root; parameters[1 + b]: rotation vector of bone b relative to its parent.
  template <class T>
  bool operator()(T const* const* parameters, T* residuals) const {
    const auto& bones = marker_set->skeleton.bones;
    std::vector<Eigen::Matrix<T, 3, 3>> rotations(bones.size());
    std::vector<Eigen::Matrix<T, 3, 1>> places(bones.size());
    for (std::size_t b = 0; b < bones.size(); ++b) {
      std::array<T, 9> rotation;  // column-major
      ceres::AngleAxisToRotationMatrix(parameters[1 + b], rotation.data());
      const Eigen::Matrix<T, 3, 3> local = Eigen::Map<const Eigen::Matrix<T, 3, 3>>(rotation.data());
      if (bones[b].parent < 0) {
        rotations[b] = local;
        places[b] = Eigen::Map<const Eigen::Matrix<T, 3, 1>>(parameters[0]);
        continue;
      }
      const auto parent = static_cast<std::size_t>(bones[b].parent);
      rotations[b] = rotations[parent] * local;
      places[b] = places[parent] + rotations[parent] * bones[b].rest_offset_m.cast<T>();
    }
    for (std::size_t m = 0; m < marker_set->markers.size(); ++m) {
      const auto bone = static_cast<std::size_t>(marker_set->markers[m].bone);
      Eigen::Map<Eigen::Matrix<T, 3, 1>> off(residuals + 3 * m);
      off = places[bone] + rotations[bone] * marker_set->markers[m].offset_m.cast<T>() - (*seen)[m].v.cast<T>();
    }
    return true;
  }
};

}  // namespace

struct SolveReference::Parts {
  MarkerSet marker_set;
  std::vector<WorldPoint> seen;
  std::array<double, 3> root{0.0, 0.0, 1.0};
  std::vector<std::array<double, 3>> rotations;
  ceres::Problem problem;
};

SolveReference::SolveReference(const MarkerSet& marker_set) : parts_(std::make_unique<Parts>()) {
  parts_->marker_set = marker_set;
  parts_->seen.resize(marker_set.markers.size());
  parts_->rotations.assign(marker_set.skeleton.bones.size(), {1e-6, 0.0, 0.0});
  auto* cost = new ceres::DynamicAutoDiffCostFunction<Residuals, kStride>(  // the problem owns it
      new Residuals{&parts_->marker_set, &parts_->seen});
  std::vector<double*> blocks{parts_->root.data()};
  cost->AddParameterBlock(3);
  for (auto& rotation : parts_->rotations) {
    blocks.push_back(rotation.data());
    cost->AddParameterBlock(3);
  }
  cost->SetNumResiduals(static_cast<int>(3 * marker_set.markers.size()));
  parts_->problem.AddResidualBlock(cost, nullptr, blocks);
}

SolveReference::SolveReference(SolveReference&& other) noexcept = default;
SolveReference::~SolveReference() = default;

double SolveReference::solve(std::span<const WorldPoint> markers) {
  parts_->seen.assign(markers.begin(), markers.end());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 20;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &parts_->problem, &summary);
  return std::sqrt(2.0 * summary.final_cost / static_cast<double>(markers.size()));
}

}  // namespace mocap::bench
