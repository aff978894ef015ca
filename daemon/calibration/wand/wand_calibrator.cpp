#include "calibration/wand/wand_calibrator.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "calibration/rig/approximate_lens.h"
#include "calibration/rig/assess_rig.h"
#include "calibration/wand/parse_wand.h"
#include "calibration/wand/solve_wand.h"
#include "calibration/wand/wand_rig.h"
#include "model/calibration/calibrated_camera.h"

namespace mocap::calibration {
namespace {

// Five minutes at 120 Hz. An image of a wand takes about 0.1 kB.
constexpr std::size_t kMaxImages = 36000;

// The cameras without a lens, in words.
std::string names_without_lens(const Rig& rig) {
  std::string names;
  for (const CameraModel& camera : rig) {
    if (!is_calibrated(camera)) names += (names.empty() ? "'" : ", '") + camera.name + "'";
  }
  return names;
}

CalibrationResult result_of(const WandSolution& solution, PlacedRig placed, const RigAssessment& assessment) {
  CalibrationResult result;
  result.calibrated.facts = facts_of(solution, placed);
  result.floor_is_guessed = placed.floor_is_guessed;
  result.calibrated.rig = std::move(placed.rig);
  result.grade = name_of(assessment.grade);
  result.rms_px = assessment.rms_px;
  result.heldout_px = assessment.heldout_px;
  result.samples = solution.samples;
  result.wand_m = solution.length_mean_m;
  result.wand_std_m = solution.length_std_m;
  for (const RigIssue& issue : assessment.issues) result.issues.push_back(issue.text);
  return result;
}

}  // namespace

WandCalibrator::WandCalibrator(RigBefore known, int threads) : known_(std::move(known)), threads_(threads) {}

Status WandCalibrator::start(const CalibrationOrder& order) {
  auto wand = wand_of(order.wand_m);
  if (!wand) return wand.error();
  const Rig& rig = known_.rig;
  if (rig.size() < 2) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("a wand calibrates cameras against each other: there are {}, expected at least two", rig.size())};
  }
  if (const std::string missing = names_without_lens(rig); !order.fov_deg && !missing.empty()) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("the lens of camera {} is not calibrated: set the horizontal field of view of such cameras "
                    "(fov_deg), or calibrate the lenses with mocap-calibrate lens",
                    missing)};
  }
  order_ = order;
  wand_ = *std::move(wand);
  start_ = rig;
  progress_.reset();
  recording_.cameras.assign(rig.size(), {});
  solved_cameras_.clear();
  result_.reset();
  message_.clear();
  is_lens_known_ = true;
  for (CameraModel& camera : start_) {
    if (!order.fov_deg || (!order.refine_lens && !takes_field_of_view(camera))) continue;
    camera.lens.fx_px = 0.0;  // until the first image
    is_lens_known_ = false;
  }
  state_ = CalibrationState::Collecting;
  return {};
}

// Sets the image size and, if the lens is not known, an approximate one. Returns whether all cameras are prepared.
bool WandCalibrator::prepare(std::size_t camera, const CalibrationImage& image) {
  if (progress_) return true;
  CameraModel& model = start_[camera];
  if (order_.fov_deg && !is_calibrated(model)) {
    model.width_px = image.width_px;
    model.height_px = image.height_px;
    model.lens = lens_of({.fov_deg = *order_.fov_deg, .kind = model.lens.kind}, image.width_px, image.height_px);
  }
  if (!std::ranges::all_of(start_, is_calibrated)) return false;
  progress_.emplace(start_, wand_, WandProgressSettings{.lens_known = is_lens_known_});
  return true;
}

bool WandCalibrator::add(std::size_t camera, const CalibrationImage& image) {
  if (state_ != CalibrationState::Collecting || camera >= start_.size()) return false;
  if (!prepare(camera, image)) return true;
  std::vector<Picture>& images = recording_.cameras[camera];
  if (images.size() >= kMaxImages) return false;
  if (!images.empty() && image.exposed_at <= images.back().exposed_at) return true;
  Picture& picture = images.emplace_back();
  picture.exposed_at = image.exposed_at;
  for (const CalibrationSpot& spot : image.spots) picture.spots.push_back({spot.at, spot.sigma_px});
  progress_->add(camera, picture);
  return images.size() < kMaxImages;
}

void WandCalibrator::fail(CalibrationState state, std::string message) {
  state_ = state;
  message_ = std::move(message);
}

void WandCalibrator::solve(const CalibrationProgress& progress) {
  if (!progress_) return fail(CalibrationState::Failed, "not every camera has delivered images; look at their state");
  state_ = CalibrationState::Solving;
  WandSettings settings;
  settings.lens_known = is_lens_known_;
  settings.refine_lens = order_.refine_lens;
  settings.threads = threads_;
  const auto solution = solve_wand(recording_, start_, wand_, settings, progress);
  if (!solution) {
    const bool cancelled = solution.error().message == kCancelled;
    return fail(cancelled ? CalibrationState::Cancelled : CalibrationState::Failed, solution.error().message);
  }
  if (const auto refused = order_.moved ? std::nullopt : wrong_scale(*solution, known_.rig)) {
    return fail(CalibrationState::Failed, *refused);
  }
  PlacedRig placed = place_in_world(*solution, known_);
  const RigAssessment assessment = assess_rig(evidence_of(*solution, measured_world(placed)));
  for (const CameraAssessment& camera : assessment.cameras) {
    CalibrationCamera& figures = solved_cameras_.emplace_back();
    figures.rms_px = camera.rms_px;
    figures.heldout_px = camera.heldout_px;
    figures.points = camera.points;
    figures.position_sigma_m = camera.position_sigma_m;
    figures.rotation_sigma_rad = camera.rotation_sigma_rad;
  }
  result_ = result_of(*solution, std::move(placed), assessment);
  if (const auto kept = lenses_that_are_kept(known_.rig); kept && order_.fov_deg && !order_.refine_lens)
    result_->issues.push_back(*kept);
  state_ = CalibrationState::Solved;
}

void WandCalibrator::describe_progress(CalibrationReport& report) const {
  for (std::size_t c = 0; c < report.cameras.size(); ++c) {
    const CameraProgress progress = progress_->progress_of(c);
    CalibrationCamera& camera = report.cameras[c];
    camera.images = progress.images;
    camera.samples = progress.samples;
    camera.shared = progress.shared;
    camera.coverage = progress.coverage;
    camera.cells = progress.cells;
    camera.is_connected = progress.is_connected;
  }
  report.is_complete = progress_->is_complete();
  report.advice = progress_->advice();
  report.min_shared = progress_->min_samples();
}

CalibrationReport WandCalibrator::report() const {
  CalibrationReport report;
  report.state = state_;
  report.message = message_;
  if (state_ == CalibrationState::Idle) return report;
  report.cameras = solved_cameras_;
  report.cameras.resize(start_.size());
  for (std::size_t c = 0; c < start_.size(); ++c) report.cameras[c].name = start_[c].name;
  if (progress_) {
    describe_progress(report);
  } else {
    const auto unseen = std::ranges::find_if_not(start_, is_calibrated);
    report.advice = fmt::format("camera {} has not delivered an image yet",
                                unseen == start_.end() ? start_.front().name : unseen->name);
  }
  report.result = result_;
  return report;
}

}  // namespace mocap::calibration
