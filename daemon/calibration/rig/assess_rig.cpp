#include "calibration/rig/assess_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

// Upper limits of the grades excellent, good and fair. All limits are chosen by hand; not yet measured.
struct Limits {
  double excellent;
  double good;
  double fair;
};
constexpr Limits kRms_px{0.25, 0.5, 1.0};          // the noise of the detector is about 0.1 px
constexpr Limits kHeldOutRatio{1.15, 1.3, 2.0};    // held-out rms over rms; 1: the rig is well determined
constexpr Limits kWandStd{0.002, 0.005, 0.01};     // standard deviation over the length
constexpr Limits kWandMean{0.0005, 0.001, 0.005};  // mean of the length against the nominal one, relative
constexpr Limits kSigma_m{0.0005, 0.001, 0.005};   // median over the volume
constexpr Limits kSystematic{0.3, 0.6, 1.5};       // systematic residual over the rms of the camera
constexpr double kMinSystematic_px = 0.03;         // a smaller systematic residual is no issue
constexpr double kGoodCoverage = 0.3;              // fraction of the image cells
constexpr double kFairCoverage = 0.12;
constexpr std::size_t kGoodPoints = 150;  // observations of a camera
constexpr std::size_t kFairPoints = 40;
constexpr std::size_t kMinHeldOut = 10;
constexpr int kMinPointsInCell = 3;
constexpr double kMaxUnseenFraction = 0.1;

Grade grade_of(double figure, const Limits& limits) {
  if (figure <= limits.excellent) return Grade::Excellent;
  if (figure <= limits.good) return Grade::Good;
  return figure <= limits.fair ? Grade::Fair : Grade::Poor;
}

struct Sum {
  double squares = 0.0;
  std::size_t points = 0;
  double rms() const { return points > 0 ? std::sqrt(squares / (2.0 * static_cast<double>(points))) : 0.0; }
};

std::size_t cell_index(int row, int column) {
  return static_cast<std::size_t>(row) * kImageCells + static_cast<std::size_t>(column);
}

int cell_at(double at, int size) { return std::clamp(static_cast<int>(at * kImageCells / size), 0, kImageCells - 1); }

// Rms over the cells of the mean residual of a cell, per axis. The variance that random noise gives the mean of the
// residuals of a cell is subtracted.
double systematic_residual(const CameraAssessment& camera) {
  double sum = 0.0;
  int cells = 0;
  for (const ImageCell& cell : camera.cells) {
    if (cell.points < kMinPointsInCell) continue;
    sum += 0.5 * cell.residual_px.squaredNorm() - camera.rms_px * camera.rms_px / cell.points;
    ++cells;
  }
  return cells > 0 ? std::sqrt(std::max(0.0, sum / cells)) : 0.0;
}

/// The steps of assess_rig.
class RigAssessor {
 public:
  explicit RigAssessor(const RigEvidence& evidence) : evidence_(evidence) {}

  RigAssessment assess() {
    compute_camera_figures();
    assess_cameras();
    assess_determinacy();
    assess_synchronisation();
    assess_wand();
    assess_floor();
    assess_volume();
    auto& issues = assessment_.issues;
    std::stable_sort(issues.begin(), issues.end(), [](const auto& a, const auto& b) { return a.grade > b.grade; });
    if (!issues.empty()) assessment_.grade = issues.front().grade;
    return std::move(assessment_);
  }

 private:
  void add_issue(Grade grade, const std::string& text) {
    if (grade == Grade::Excellent) return;
    RigIssue& issue = assessment_.issues.emplace_back();
    issue.grade = grade;
    issue.text = text;
  }

  void compute_camera_figures() {
    const std::size_t n = evidence_.rig.size();
    std::vector<Sum> training(n);
    std::vector<Sum> heldout(n);
    assessment_.cameras.resize(n);
    for (const ObservationResidual& observation : evidence_.residuals) {
      const auto c = static_cast<std::size_t>(observation.camera);
      Sum& sum = observation.held_out ? heldout[c] : training[c];
      sum.squares += observation.residual_px.squaredNorm();
      ++sum.points;
      if (observation.held_out) continue;
      const CameraModel& model = evidence_.rig[c];
      const int row = cell_at(observation.at.v.y() + 0.5, model.height_px);
      const int column = cell_at(observation.at.v.x() + 0.5, model.width_px);
      ImageCell& cell = assessment_.cameras[c].cells[cell_index(row, column)];
      ++cell.points;
      cell.residual_px += (observation.residual_px - cell.residual_px) / cell.points;
    }
    Sum all;
    Sum all_heldout;
    for (std::size_t c = 0; c < n; ++c) {
      CameraAssessment& camera = assessment_.cameras[c];
      camera.name = evidence_.rig[c].name;
      camera.rms_px = training[c].rms();
      camera.points = training[c].points;
      camera.heldout_points = heldout[c].points;
      if (heldout[c].points >= kMinHeldOut) camera.heldout_px = heldout[c].rms();
      const auto covered = std::ranges::count_if(camera.cells, [](const ImageCell& f) { return f.points > 0; });
      camera.coverage = static_cast<double>(covered) / static_cast<double>(camera.cells.size());
      camera.systematic_px = systematic_residual(camera);
      all.squares += training[c].squares;
      all.points += training[c].points;
      all_heldout.squares += heldout[c].squares;
      all_heldout.points += heldout[c].points;
      const auto first = 6 * static_cast<Eigen::Index>(c);
      if (evidence_.covariance.rows() < first + 6) continue;
      camera.position_sigma_m = std::sqrt(evidence_.covariance.diagonal().segment<3>(first).sum());
      camera.rotation_sigma_rad = std::sqrt(evidence_.covariance.diagonal().segment<3>(first + 3).sum());
    }
    assessment_.rms_px = all.rms();
    if (all_heldout.points >= kMinHeldOut) assessment_.heldout_px = all_heldout.rms();
  }

  void assess_cameras() {
    for (const CameraAssessment& camera : assessment_.cameras) {
      if (evidence_.residuals.empty()) return;
      const auto add = [&](Grade grade, const std::string& text) {
        add_issue(grade, fmt::format("camera '{}': {}", camera.name, text));
      };
      if (camera.points < kGoodPoints) {
        add(camera.points < kFairPoints ? Grade::Poor : Grade::Fair,
            fmt::format("only {} points, expected at least {}; wave the wand longer in the view of this camera",
                        camera.points, kGoodPoints));
      } else if (camera.coverage < kGoodCoverage) {
        add(camera.coverage < kFairCoverage ? Grade::Fair : Grade::Good,
            fmt::format("points in only {:.0f} % of its image{}; wave the wand there, too", 100.0 * camera.coverage,
                        sides_without_points(camera)));
      }
      add(grade_of(camera.rms_px, kRms_px),
          fmt::format("{:.2f} px rms, expected at most {:.2g}; check its focus, exposure and false blobs, or calibrate "
                      "its lens again (mocap-calibrate lens)",
                      camera.rms_px, kRms_px.good));
      if (camera.heldout_px && camera.rms_px > 0.0) {
        const double ratio = *camera.heldout_px / camera.rms_px;
        if (ratio > kHeldOutRatio.good) {
          add(grade_of(ratio, kHeldOutRatio),
              fmt::format("{:.2f} px rms on held-out samples, {:.1f} times that of the others; wave the wand longer in "
                          "the view of this camera, and nearer to the border of its image",
                          *camera.heldout_px, ratio));
        }
      }
      if (camera.systematic_px > kMinSystematic_px) {
        add(grade_of(camera.systematic_px / std::max(1e-9, camera.rms_px), kSystematic),
            fmt::format("a systematic residual of {:.2f} px over its image: the lens file does not fit; calibrate the "
                        "lens (mocap-calibrate lens), or use --refine-lens",
                        camera.systematic_px));
      }
    }
  }

  // ", none left and top": the outer quarters of the image without a point.
  static std::string sides_without_points(const CameraAssessment& camera) {
    constexpr int kQuarter = kImageCells / 4;
    std::array<int, 4> counts{};  // left, right, top, bottom
    for (int row = 0; row < kImageCells; ++row) {
      for (int column = 0; column < kImageCells; ++column) {
        const int points = camera.cells[cell_index(row, column)].points;
        counts[0] += column < kQuarter ? points : 0;
        counts[1] += column >= kImageCells - kQuarter ? points : 0;
        counts[2] += row < kQuarter ? points : 0;
        counts[3] += row >= kImageCells - kQuarter ? points : 0;
      }
    }
    std::string sides;
    constexpr std::array<const char*, 4> kNames{"left", "right", "top", "bottom"};
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      if (counts[i] == 0) sides += (sides.empty() ? ", none " : " and ") + std::string(kNames[i]);
    }
    return sides;
  }

  void assess_determinacy() {
    if (evidence_.rig.size() < 2) add_issue(Grade::Poor, "fewer than two cameras: no marker can be triangulated");
    if (is_undetermined()) {
      add_issue(
          Grade::Poor,
          "the uncertainty of the cameras is unknown: the samples do not determine the rig; wave the wand longer, "
          "in all directions");
    }
    if (!evidence_.residuals.empty() && !assessment_.heldout_px) {
      add_issue(Grade::Fair,
                "the rig is not validated: there are too few held-out samples, or the adjustment without them does not "
                "converge; wave the wand longer");
    }
  }

  bool is_undetermined() const { return !evidence_.residuals.empty() && evidence_.covariance.size() == 0; }

  void assess_synchronisation() {
    for (const std::string& camera : evidence_.unsynchronised) {
      add_issue(Grade::Fair,
                fmt::format("the synchronisation of camera '{}' was not checked: that needs two other cameras that see "
                            "the wand together with this one, a wand that moves fast, and 17 images a second or more",
                            camera));
    }
  }

  void assess_wand() {
    if (evidence_.lengths_m.empty() || !(evidence_.nominal_length_m > 0.0)) return;
    WandAssessment wand;
    wand.nominal_m = evidence_.nominal_length_m;
    wand.samples = evidence_.lengths_m.size();
    for (const double length : evidence_.lengths_m) wand.mean_m += length / static_cast<double>(wand.samples);
    double squares = 0.0;
    for (const double length : evidence_.lengths_m) squares += (length - wand.mean_m) * (length - wand.mean_m);
    wand.std_m = std::sqrt(squares / static_cast<double>(wand.samples));
    const auto [least, most] = std::ranges::minmax_element(evidence_.lengths_m);
    wand.min_m = *least;
    wand.max_m = *most;
    assessment_.wand = wand;
    assessment_.wand_mismatch = wand.mean_m / wand.nominal_m - 1.0;
    add_issue(
        grade_of(wand.std_m / wand.nominal_m, kWandStd),
        fmt::format("the triangulated length of the wand is {:.2f} mm +- {:.2f}, expected {:.1f} +- {:.1f} at most; "
                    "check that its "
                    "markers are round and that the cameras are synchronised",
                    1e3 * wand.mean_m, 1e3 * wand.std_m, 1e3 * wand.nominal_m, 1e3 * kWandStd.good * wand.nominal_m));
    add_issue(grade_of(std::abs(*assessment_.wand_mismatch), kWandMean),
              fmt::format("the mean of the triangulated length is {:+.2f} % off the length of the wand, which the "
                          "adjustment keeps; measure the wand and set its true marker positions with --wand",
                          100.0 * *assessment_.wand_mismatch));
  }

  void assess_floor() {
    if (!evidence_.floor_is_measured) {
      if (!evidence_.residuals.empty())
        add_issue(Grade::Good,
                  "the floor is not measured: put a floor frame or markers on the floor and run mocap-calibrate floor");
      return;
    }
    if (evidence_.rig.empty()) return;
    double lowest_m = std::numeric_limits<double>::infinity();
    for (const CameraModel& camera : evidence_.rig) lowest_m = std::min(lowest_m, camera.centre().v.z());
    assessment_.lowest_camera_m = lowest_m;
    if (lowest_m < 0.0) {
      add_issue(Grade::Poor, fmt::format("a camera is {:.0f} mm below the floor: the world is upside down or mirrored; "
                                         "measure the floor again (mocap-calibrate floor)",
                                         -1e3 * lowest_m));
    }
  }

  void assess_volume() {
    if (is_undetermined()) return;  // the noise alone would give a small uncertainty
    assessment_.volume =
        volume_uncertainty(evidence_.points_m, evidence_.rig, evidence_.covariance, assessment_.rms_px);
    if (!assessment_.volume) return;
    const VolumeUncertainty& volume = *assessment_.volume;
    if (!volume.median_m) {
      add_issue(Grade::Poor,
                "no point of the volume can be triangulated: fewer than two cameras see it, or their rays are nearly "
                "parallel; turn the cameras to a common volume");
      return;
    }
    add_issue(
        grade_of(*volume.median_m, kSigma_m),
        fmt::format("the median uncertainty of a marker position in the volume is {:.1f} mm, expected at most {:.0f}; "
                    "wave the wand longer, or move cameras nearer and to wider angles",
                    1e3 * *volume.median_m, 1e3 * kSigma_m.good));
    if (volume.unseen_fraction > kMaxUnseenFraction) {
      add_issue(Grade::Good, fmt::format("{:.0f} % of the volume is seen by fewer than two cameras",
                                         100.0 * volume.unseen_fraction));
    }
  }

  const RigEvidence& evidence_;
  RigAssessment assessment_;
};

}  // namespace

const char* name_of(Grade grade) {
  switch (grade) {
    case Grade::Excellent: return "excellent";
    case Grade::Good: return "good";
    case Grade::Fair: return "fair";
    case Grade::Poor: return "poor";
  }
  return "";
}

RigAssessment assess_rig(const RigEvidence& evidence) { return RigAssessor(evidence).assess(); }

}  // namespace mocap::calibration
