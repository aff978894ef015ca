#include "calibration/wand/hold_out.h"

#include <algorithm>
#include <cmath>

namespace mocap::calibration {
namespace {

constexpr int kEach = 10;
// Fewer markers tell no rms.
constexpr std::size_t kLeastSights = 20;

struct Sum {
  double squares = 0.0;
  std::size_t sights = 0;

  double rms() const { return sights < kLeastSights ? 0.0 : std::sqrt(squares / (2.0 * static_cast<double>(sights))); }
};

Bundle part_of(const Bundle& whole, bool held_out) {
  Bundle part{whole.rig, whole.wand, whole.places, {}};
  std::ranges::copy_if(whole.sights, std::back_inserter(part.sights),
                       [&](const Sight& sight) { return (sight.place % kEach == 0) == held_out; });
  return part;
}

void list(const Bundle& bundle, bool held_out, std::vector<SightResidual>& residuals) {
  for (const Sight& sight : bundle.sights) {
    if (const auto residual = bundle.residual_px(sight))
      residuals.push_back({sight.camera, {sight.px}, *residual, held_out});
  }
}

}  // namespace

void hold_out(WandSolution& solution, LensFreedom lens, int threads) {
  solution.residuals.clear();
  list(solution.bundle, false, solution.residuals);
  BundleSettings settings;
  settings.lens = lens;
  settings.outlier_sigmas = 0.0;
  settings.most_steps = 10;
  settings.settled = 1e-7;
  settings.threads = threads;
  Bundle kept = part_of(solution.bundle, false);
  if (kept.sights.empty() || !adjust(kept, settings)) return;
  Bundle tried = part_of(solution.bundle, true);
  tried.rig = std::move(kept.rig);
  settings.hold_rig = true;
  if (tried.sights.empty() || !adjust(tried, settings)) return;
  const std::size_t first = solution.residuals.size();
  list(tried, true, solution.residuals);

  Sum all;
  std::vector<Sum> of_camera(solution.cameras.size());
  for (std::size_t i = first; i < solution.residuals.size(); ++i) {
    const SightResidual& one = solution.residuals[i];
    for (Sum* sum : {&all, &of_camera[static_cast<std::size_t>(one.camera)]}) {
      sum->squares += one.residual_px.squaredNorm();
      ++sum->sights;
    }
  }
  solution.heldout_px = all.rms();
  for (std::size_t c = 0; c < of_camera.size(); ++c) solution.cameras[c].heldout_px = of_camera[c].rms();
}

}  // namespace mocap::calibration
