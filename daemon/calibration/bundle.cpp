#include "calibration/bundle.h"

#include <ceres/ceres.h>

#include <array>

#include "calibration/bundle_problem.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

class Watch final : public ceres::IterationCallback {
 public:
  explicit Watch(const std::function<bool(int)>& progress) : progress_(progress) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    return !progress_ || progress_(summary.iteration) ? ceres::SOLVER_CONTINUE : ceres::SOLVER_TERMINATE_SUCCESSFULLY;
  }

 private:
  const std::function<bool(int)>& progress_;
};

}  // namespace

std::optional<Eigen::Vector2d> Bundle::residual_px(const Sight& sight) const {
  const auto& camera = rig[static_cast<std::size_t>(sight.camera)];
  const auto at = geometry::project(camera, marker(places[static_cast<std::size_t>(sight.place)], sight.mark));
  if (!at) return std::nullopt;
  return sight.px - at->v;
}

bool adjust(Bundle& bundle, const BundleSettings& settings, const std::function<bool(int)>& progress) {
  BundleProblem problem(bundle, settings);
  Watch watch(progress);
  ceres::Solver::Options options;
  if (settings.hold_rig) {
    options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;  // places alone: blocks of five
  } else {
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering = problem.places_first();
  }
  options.max_num_iterations = settings.most_steps;
  options.function_tolerance = settings.settled;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-12;
  options.num_threads = settings.threads;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem.get(), &summary);
  if (!summary.IsSolutionUsable()) return false;
  problem.write_back(bundle);
  return true;
}

}  // namespace mocap::calibration
