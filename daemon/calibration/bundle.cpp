#include "calibration/bundle.h"

#include <ceres/ceres.h>

#include <array>

#include "calibration/bundle_problem.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

class ProgressCallback final : public ceres::IterationCallback {
 public:
  explicit ProgressCallback(const std::function<bool(int)>& progress) : progress_(progress) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    return !progress_ || progress_(summary.iteration) ? ceres::SOLVER_CONTINUE : ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

 private:
  const std::function<bool(int)>& progress_;
};

}  // namespace

std::optional<Eigen::Vector2d> Bundle::residual_px(const Observation& observation) const {
  const auto& camera = rig[static_cast<std::size_t>(observation.camera)];
  const WandPose& pose = wand_poses[static_cast<std::size_t>(observation.wand_pose)];
  const auto projected = geometry::project(camera, marker_position(pose, observation.marker));
  if (!projected) return std::nullopt;
  return observation.px - projected->v;
}

bool adjust_bundle(Bundle& bundle, const BundleSettings& settings, const std::function<bool(int)>& progress) {
  BundleProblem problem(bundle, settings);
  ProgressCallback callback(progress);
  ceres::Solver::Options options;
  if (settings.fix_cameras) {
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;  // block-diagonal: 5 x 5 for each wand pose
  } else {
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = problem.elimination_order();
  }
  options.max_num_iterations = settings.max_iterations;
  options.function_tolerance = settings.cost_tolerance;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-12;
  options.num_threads = settings.threads;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem.get(), &summary);
  if (!summary.IsSolutionUsable()) return false;
  problem.write_back(bundle);
  return true;
}

}  // namespace mocap::calibration
