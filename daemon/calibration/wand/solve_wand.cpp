#include "calibration/wand/solve_wand.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "calibration/wand/cross_validation.h"
#include "calibration/wand/initial_extrinsics.h"
#include "calibration/wand/solution_quality.h"
#include "calibration/wand/time_offset.h"
#include "calibration/wand/wand_detections.h"
#include "calibration/wand/wand_poses.h"

namespace mocap::calibration {
namespace {

// Largest distance from the epipolar line, with known lenses and with approximate ones, whose distortion is unknown.
constexpr double kEpipolarGate_px = 1.5;
constexpr double kEpipolarGateOfUnknownLens_px = 8.0;

// Smallest fraction of the wand markers detected by a camera that must be where the other cameras predict them. Chosen
// by hand; decisions/0004.
constexpr double kMinCameraInlierFraction = 0.3;
// A camera is not judged from fewer detected markers: the samples that are left of a long recording may lack a camera
// that sees little. Ten images of a wand; chosen by hand.
constexpr std::size_t kMinJudgedMarkers = 30;

// Wands are manufactured to half a millimetre; a larger difference is a wrong --wand.
constexpr double kMaxMarkerOffset_m = 2e-3;

/// One stage of the adjustment: the free intrinsics, the gate of a blob about its marker, and the bounds of the work.
struct Stage {
  FreeIntrinsics free_intrinsics;
  double gate_px;
  std::size_t max_samples;
  int max_iterations;
};

// From coarse to fine. With unknown lenses the first gates include the unknown distortion. Chosen by hand; figures of
// the result: mocap-eval wand.
std::vector<Stage> stages_of(const WandSettings& settings) {
  const std::size_t all = static_cast<std::size_t>(settings.max_samples);
  if (settings.lens_known) {
    const FreeIntrinsics free = settings.refine_lens ? FreeIntrinsics::All : FreeIntrinsics::None;
    return {{FreeIntrinsics::None, 20.0, 400, 30}, {free, 3.0, 1500, 30}, {free, 1.5, all, 20}};
  }
  return {{FreeIntrinsics::FocalLengths, 60.0, 400, 60},
          {FreeIntrinsics::FocalLengthsAndK1, 30.0, 600, 60},
          {FreeIntrinsics::All, 10.0, 1500, 60},
          {FreeIntrinsics::All, 3.0, 1500, 40},
          {FreeIntrinsics::All, 1.5, all, 25}};
}

WandPoseSettings pose_settings_of(const Stage& stage) {
  return {.gate_px = stage.gate_px, .max_samples = stage.max_samples};
}

std::optional<WandError> check_time_offsets(const std::vector<TimeOffset>& offsets, const Rig& rig) {
  const auto camera = unsynchronised_camera(offsets);
  if (!camera) return std::nullopt;
  const double late_s = offsets[*camera].late_s;
  return WandError{
      WandFault::NotSynchronous,
      fmt::format("camera '{}': its images are about {:.1f} ms {} those of the other cameras; synchronise the cameras "
                  "(a common trigger, or PTP) and record again",
                  rig[*camera].name, 1e3 * std::abs(late_s), late_s > 0.0 ? "later than" : "earlier than")};
}

// Refuses a camera whose initial pose was estimated from chance inliers: the other cameras do not confirm its views.
// Its detections count at all instants that the stage tried, also where no wand pose could be triangulated. The camera
// with the smallest fraction is named, because it spoils the wand poses of the others.
std::optional<WandError> check_inlier_fractions(const WandDetections& detections, const Bundle& bundle,
                                                const WandSettings& settings, const Stage& stage, double gate_px) {
  std::vector<std::size_t> inliers(bundle.rig.size(), 0);
  std::vector<std::size_t> detected(bundle.rig.size(), 0);
  for (const Observation& observation : bundle.observations) ++inliers[static_cast<std::size_t>(observation.camera)];
  for (const std::size_t instant : sample_instants(detections, pose_settings_of(stage))) {
    for (std::size_t c = 0; c < bundle.rig.size(); ++c)
      detected[c] += detections.views[c][instant] ? bundle.wand.marks_m.size() : 0;
  }
  std::vector<double> fractions;
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    const bool is_judged = detected[c] >= kMinJudgedMarkers;
    fractions.push_back(is_judged ? static_cast<double>(inliers[c]) / static_cast<double>(detected[c]) : 1.0);
  }
  const auto c = static_cast<std::size_t>(std::ranges::min_element(fractions) - fractions.begin());
  if (fractions[c] >= kMinCameraInlierFraction) return std::nullopt;
  if (auto mirrored = check_mirrored(detections, bundle.rig, c, bundle.wand, settings, gate_px)) return mirrored;
  return WandError{
      WandFault::NoOverlap,
      fmt::format("camera '{}': only {} of {} wand markers that it detects are where the other cameras predict them; "
                  "check its lens file and its synchronisation, and wave the wand in the common view of this and "
                  "other cameras",
                  bundle.rig[c].name, inliers[c], detected[c])};
}

std::optional<WandError> check_markers(const Bundle& bundle) {
  const std::vector<double> measured = triangulated_markers_m(bundle);
  const std::vector<double>& nominal = bundle.wand.marks_m;
  if (measured.size() != 3 || std::abs(measured[1] - nominal[1]) <= kMaxMarkerOffset_m) return std::nullopt;
  return WandError{
      WandFault::WrongWand,
      fmt::format("the middle marker of the wand is at {:.0f} mm of {:.0f}, expected {:.0f}; set the marker "
                  "positions of your wand, from one end, with --wand",
                  1e3 * measured[1], 1e3 * measured[2], 1e3 * nominal[1])};
}

WandError not_convergent() {
  return {WandFault::NoSolution,
          "the adjustment of cameras and wand does not converge; check the marker positions of the wand and the lens "
          "files"};
}

// Triangulates the wand with the gate of the stage, then adjusts cameras and wand poses to the blobs inside the gate.
// The last stage uses the squared loss and removes outliers instead.
std::optional<WandError> run_stage(const WandDetections& detections, const Stage& stage, bool last,
                                   const WandSettings& settings, const std::function<bool(int)>& progress,
                                   Bundle& bundle) {
  triangulate_wand_poses(detections, bundle, pose_settings_of(stage));
  if (bundle.wand_poses.size() < static_cast<std::size_t>(settings.min_samples)) {
    return WandError{WandFault::TooFewSamples,
                     fmt::format("only {} samples are consistent over two cameras or more, expected at least {}; wave "
                                 "the wand longer in the common view of several cameras",
                                 bundle.wand_poses.size(), settings.min_samples)};
  }
  BundleSettings adjustment;
  adjustment.free_intrinsics = stage.free_intrinsics;
  adjustment.loss_scale_sigmas = 0.5 * stage.gate_px / bundle.observations.front().sigma_px;
  adjustment.max_iterations = stage.max_iterations;
  adjustment.threads = settings.threads;
  if (last) {
    remove_outliers(bundle);
    adjustment.loss_scale_sigmas = 0.0;
  }
  if (!adjust_bundle(bundle, adjustment, progress)) return not_convergent();
  if (last && remove_outliers(bundle) > 0 && !adjust_bundle(bundle, adjustment, progress)) return not_convergent();
  return std::nullopt;
}

}  // namespace

Result<WandSolution, WandError> solve_wand(const Take& recording, const Rig& start, const Wand& wand,
                                           const WandSettings& settings, const Progress& progress) {
  bool goes_on = true;
  const auto report = [&](const char* step, double fraction) {
    goes_on = goes_on && (!progress || progress(step, fraction));
    return goes_on;
  };
  const WandError cancelled{WandFault::NoSolution, kCancelled};
  if (!report("detecting the wand", 0.0)) return cancelled;
  auto detections = detect_wands(recording, start, wand, settings);
  if (!detections) return detections.error();
  const double epipolar_gate_px = settings.lens_known ? kEpipolarGate_px : kEpipolarGateOfUnknownLens_px;
  auto rig = initial_extrinsics(*detections, start, wand, settings, epipolar_gate_px, progress);
  if (!rig) return rig.error();

  Bundle bundle;
  bundle.wand = wand;
  bundle.rig = *std::move(rig);
  for (const CameraModel& camera : start)
    bundle.known_lenses.push_back(!settings.refine_lens && !camera.lens.is_from_fov);
  std::vector<bool> synchronisation_checked(start.size(), false);
  const std::vector<Stage> stages = stages_of(settings);
  for (std::size_t s = 0; s < stages.size(); ++s) {
    const Stage& stage = stages[s];
    const bool last = s + 1 == stages.size();
    const auto iterations = [&](int iteration) {
      return report("adjusting", (static_cast<double>(s) + static_cast<double>(iteration) / stage.max_iterations) /
                                     static_cast<double>(stages.size()));
    };
    const auto failed = run_stage(*detections, stage, last, settings, iterations, bundle);
    if (!goes_on) return cancelled;  // the checks below would judge a bundle that is not adjusted
    if (failed) return *failed;
    // Before the gates are so narrow that they exclude the displaced views of fast markers.
    if (s + 1 == stages.size() / 2) {
      const auto offsets = estimate_time_offsets(*detections, bundle, 2.0 * stage.gate_px);
      for (std::size_t c = 0; c < offsets.size(); ++c) synchronisation_checked[c] = is_determined(offsets[c]);
      if (auto error = check_time_offsets(offsets, bundle.rig)) return *error;
      if (auto error = check_markers(bundle)) return *error;
    }
    if (last || (s == 0 && settings.lens_known)) {
      if (auto error = check_inlier_fractions(*detections, bundle, settings, stage, epipolar_gate_px)) return *error;
    }
  }
  const std::vector<TimeOffset> offsets = estimate_time_offsets(*detections, bundle, stages.back().gate_px);
  WandSolution solution = assess_solution(std::move(bundle), stages.back().free_intrinsics);
  if (!report("validating", 0.95)) return cancelled;
  validate_held_out(solution, stages.back().free_intrinsics, settings.threads,
                    [&](int) { return report("validating", 0.95); });
  if (!report("validating", 1.0)) return cancelled;
  for (std::size_t c = 0; c < offsets.size(); ++c) {
    solution.cameras[c].time_offset_s = offsets[c].late_s;
    solution.cameras[c].time_offset_sigma_s = offsets[c].sigma_s;
    solution.cameras[c].synchronisation_checked = synchronisation_checked[c];
  }
  return solution;
}

}  // namespace mocap::calibration
