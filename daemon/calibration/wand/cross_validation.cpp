#include "calibration/wand/cross_validation.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calibration/bundle.h"

namespace mocap::calibration {
namespace {

// Every tenth wand pose is held out: the rig loses little.
constexpr int kHoldOutInterval = 10;
// Below so many observations no rms is given.
constexpr std::size_t kMinErrors = 20;

struct Sum {
  double squares = 0.0;
  std::size_t observations = 0;

  std::optional<double> rms() const {
    if (observations < kMinErrors) return std::nullopt;
    return std::sqrt(squares / (2.0 * static_cast<double>(observations)));
  }
};

Bundle part_of(const Bundle& whole, bool held_out) {
  Bundle part{whole.rig, whole.wand, whole.wand_poses, {}, whole.known_lenses};
  std::ranges::copy_if(whole.observations, std::back_inserter(part.observations), [&](const Observation& observation) {
    return (observation.wand_pose % kHoldOutInterval == 0) == held_out;
  });
  return part;
}

void append_residuals(const Bundle& bundle, bool held_out, std::vector<ObservationResidual>& residuals) {
  for (const Observation& observation : bundle.observations) {
    if (const auto residual = bundle.residual_px(observation))
      residuals.push_back({observation.camera, {observation.px}, *residual, held_out});
  }
}

}  // namespace

void validate_held_out(WandSolution& solution, FreeIntrinsics free_intrinsics, int threads,
                       const std::function<bool(int)>& goes_on) {
  solution.residuals.clear();
  append_residuals(solution.bundle, false, solution.residuals);
  BundleSettings settings;
  settings.free_intrinsics = free_intrinsics;
  settings.loss_scale_sigmas = 0.0;
  settings.max_iterations = 10;
  settings.cost_tolerance = 1e-7;
  settings.threads = threads;
  Bundle training = part_of(solution.bundle, false);
  if (training.observations.empty() || !adjust_bundle(training, settings, goes_on)) return;
  Bundle validation = part_of(solution.bundle, true);
  validation.rig = std::move(training.rig);
  settings.fix_cameras = true;
  if (validation.observations.empty() || !adjust_bundle(validation, settings, goes_on)) return;
  const std::size_t first = solution.residuals.size();
  append_residuals(validation, true, solution.residuals);

  Sum all;
  std::vector<Sum> of_camera(solution.cameras.size());
  for (std::size_t i = first; i < solution.residuals.size(); ++i) {
    const ObservationResidual& residual = solution.residuals[i];
    for (Sum* sum : {&all, &of_camera[static_cast<std::size_t>(residual.camera)]}) {
      sum->squares += residual.residual_px.squaredNorm();
      ++sum->observations;
    }
  }
  solution.heldout_px = all.rms();
  for (std::size_t c = 0; c < of_camera.size(); ++c) solution.cameras[c].heldout_px = of_camera[c].rms();
}

}  // namespace mocap::calibration
