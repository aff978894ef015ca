#include "calibration/wand/wand_rig.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "calibration/rig/previous_rig.h"

namespace mocap::calibration {
namespace {

// A larger relative change of the scale against the previous rig is a wrong length of the wand. Chosen by hand.
constexpr double kMaxScaleChange = 0.01;

}  // namespace

PlacedRig place_in_world(const WandSolution& solution, const RigBefore& before) {
  const Rig& rig = solution.bundle.rig;
  if (const auto previous_world = pose_in_previous_world(rig, before.rig)) {
    return {in_world(*previous_world, rig), previous_world, before.floor_is_guessed};
  }
  std::vector<Eigen::Vector3d> points;
  for (const WandPose& place : solution.bundle.wand_poses) points.push_back(place.middle_m);
  return {in_world(guess_floor(points, rig), rig), std::nullopt, true};
}

std::optional<Floor> measured_world(const PlacedRig& placed) {
  return placed.floor_is_guessed ? std::nullopt : placed.previous_world;
}

std::optional<std::string> wrong_scale(const WandSolution& solution, const Rig& before) {
  const auto scale = scale_of_previous(solution.bundle.rig, before);
  if (!scale || std::abs(*scale - 1.0) < kMaxScaleChange) return std::nullopt;
  const double nominal_mm = 1e3 * solution.bundle.wand.length_m();
  return fmt::format(
      "the cameras stand as in the previous rig, but {:.3f} times as far apart: the wand is {:.0f} mm "
      "long, expected {:.0f}; set its length with --wand, or use --moved if the previous rig is wrong",
      *scale, nominal_mm / *scale, nominal_mm);
}

RigFacts facts_of(const WandSolution& solution, const PlacedRig& placed) {
  RigFacts facts;
  facts["rms_px"] = solution.rms_px;
  if (solution.heldout_px) facts["heldout_px"] = *solution.heldout_px;
  facts["samples"] = static_cast<double>(solution.samples);
  facts["wand_length_mm"] = 1e3 * solution.bundle.wand.length_m();
  if (solution.length_mean_m > 0.0) facts["wand_std_mm"] = 1e3 * solution.length_std_m;
  facts["floor"] = std::string(placed.floor_is_guessed ? "guessed" : "kept");
  for (std::size_t c = 0; c < solution.cameras.size(); ++c) {
    const CameraAccuracy& camera = solution.cameras[c];
    facts[solution.bundle.rig[c].name + ".rms_px"] = camera.rms_px;
    if (camera.uncertainty)
      facts[solution.bundle.rig[c].name + ".position_sigma_mm"] = 1e3 * camera.uncertainty->position_m;
  }
  return facts;
}

}  // namespace mocap::calibration
