#include "calibration/lens/fit_lens.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/lens/rate_lens.h"
#include "calibration/median.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr std::size_t kLeastViews = 6;
constexpr std::size_t kLeastPoints = 100;
constexpr int kManySteps = 60;
constexpr std::size_t kStartViews = 12;
// A board whose residuals are so many times those of its like was seen wrong, or is not flat.
constexpr double kBadView = 3.5;
// What must be known for a rig to be made with the lens: a mm at 5 m is 0.02 %, ten times that is a guess.
constexpr double kMostFocalSigma = 0.004;
constexpr double kMostCentreSigma = 0.01;  // of the image's width
constexpr double kLeastReach = 0.5;
constexpr double kBorderReach = 0.75;  // boards so far out tell the last term of a polynomial
constexpr double kLeastTilt_rad = 12.0 * kDegree;
// Squares of residuals over their variance that a further part must explain: chance gives 1 each, more than 12 one time
// in 2000.
constexpr double kSignificant = 12.0;
constexpr double kWorstFit_px = 3.0;

struct Part {
  const char* name;
  std::vector<int> of;  ///< its columns of the lens's nine
};

std::vector<Part> parts_of(LensKind kind) {
  if (kind == LensKind::Fisheye) return {{"k1", {4}}, {"k2", {5}}, {"k3", {6}}, {"k4", {7}}};
  return {{"k1", {4}}, {"k2", {5}}, {"p1 and p2", {6, 7}}, {"k3", {8}}};
}

LensParts with(LensParts parts, const Part& part) {
  for (const int column : part.of) parts[column] = true;
  return parts;
}

Error refuse(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

double widest_tilt(const std::vector<CameraFromWorld>& poses) {
  double widest = 0.0;
  for (std::size_t a = 0; a < poses.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double cosine = std::abs(poses[a].rotation.col(2).dot(poses[b].rotation.col(2)));
      widest = std::max(widest, std::acos(std::min(1.0, cosine)));
    }
  }
  return widest;
}

/// Fits one camera's lens; each step needs those before it.
class LensFitter {
 public:
  LensFitter(const std::vector<BoardView>& views, int width_px, int height_px, LensKind kind)
      : width_px_(width_px), height_px_(height_px), kind_(kind) {
    bundle_.views = views;
    fit_.coverage = coverage_of(views, width_px, height_px);
    focal_and_centre_ = LensParts::Constant(false);
    focal_and_centre_.head<4>() = true;
  }

  Result<LensFit> fit() {
    if (const Status enough = check_views(); !enough) return enough.error();
    if (!start()) return refuse("no lens explains the boards; are columns, rows and the kind of lens right?");
    leave_out_bad_views();
    choose_parts();
    if (const Status good = check_fit(); !good) return good.error();
    fit_.heldout_px = leave_some_out(bundle_, parts_);
    fit_.lens = bundle_.lens;
    fit_.views = bundle_.views.size();
    return std::move(fit_);
  }

 private:
  Status check_views() const {
    std::size_t points = 0;
    for (const BoardView& view : bundle_.views) points += view.seen_px.size();
    if (bundle_.views.size() < kLeastViews || points < kLeastPoints) {
      return refuse(
          fmt::format("the board was found in {} images with {} corners in all, expected {} and {} at least; "
                      "show it at more places and angles",
                      bundle_.views.size(), points, kLeastViews, kLeastPoints));
    }
    if (fit_.coverage.reach < kLeastReach) {
      return refuse(
          fmt::format("boards reach only {:.0f} % of the way from the image's middle to its corners, expected "
                      "{:.0f} % at least; show the board near the rim, too",
                      100.0 * fit_.coverage.reach, 100.0 * kLeastReach));
    }
    return {};
  }

  Lens guess(double view_rad) const {
    Lens lens;
    lens.kind = kind_;
    const double half = 0.5 * view_rad;
    lens.fx_px = 0.5 * width_px_ / (kind_ == LensKind::Fisheye ? half : std::tan(half));
    lens.fy_px = lens.fx_px;
    lens.cx_px = 0.5 * (width_px_ - 1);
    lens.cy_px = 0.5 * (height_px_ - 1);
    return lens;
  }

  // From several fields of view the one that explains the boards best.
  bool start() {
    const std::vector<double> pinhole{20.0, 35.0, 50.0, 70.0, 100.0};
    const std::vector<double> fisheye{60.0, 90.0, 120.0, 150.0, 180.0};
    LensParts rough = LensParts::Constant(false);
    rough[0] = rough[1] = rough[4] = true;
    double best = std::numeric_limits<double>::infinity();
    LensBundle found;
    for (const double degrees : kind_ == LensKind::Fisheye ? fisheye : pinhole) {
      LensBundle trial;
      trial.lens = guess(degrees * kDegree);
      const std::size_t step = std::max<std::size_t>(1, bundle_.views.size() / kStartViews);
      for (std::size_t v = 0; v < bundle_.views.size(); v += step) {
        const auto pose = place_board(bundle_.views[v], trial.lens);
        if (!pose) continue;
        trial.views.push_back(bundle_.views[v]);
        trial.camera_from_board.push_back(*pose);
      }
      if (trial.views.size() < 3) continue;
      const LensResidue residue = adjust_lens(trial, rough, kManySteps);
      if (residue.rms_px() >= best) continue;
      best = residue.rms_px();
      found = std::move(trial);
    }
    if (!std::isfinite(best)) return false;
    return place_all(found.lens);
  }

  // All boards by the lens that was found; those that it cannot see are left out.
  bool place_all(const Lens& lens) {
    LensBundle all;
    all.lens = lens;
    for (std::size_t v = 0; v < bundle_.views.size(); ++v) {
      const auto pose = place_board(bundle_.views[v], lens);
      if (!pose) {
        fit_.left_out.push_back(v);
        continue;
      }
      all.views.push_back(std::move(bundle_.views[v]));
      all.camera_from_board.push_back(*pose);
      number_.push_back(v);
    }
    bundle_ = std::move(all);
    return bundle_.views.size() >= kLeastViews;
  }

  void leave_out_bad_views() {
    for (int round = 0; round < 3; ++round) {
      const LensResidue residue = adjust_lens(bundle_, with_some(), kManySteps);
      const double limit = kBadView * median(residue.view_rms_px);
      LensBundle kept;
      kept.lens = bundle_.lens;
      std::vector<std::size_t> numbers;
      for (std::size_t v = 0; v < bundle_.views.size(); ++v) {
        if (residue.view_rms_px[v] > limit) {
          fit_.left_out.push_back(number_[v]);
          continue;
        }
        kept.views.push_back(std::move(bundle_.views[v]));
        kept.camera_from_board.push_back(bundle_.camera_from_board[v]);
        numbers.push_back(number_[v]);
      }
      const bool all_good = numbers.size() == number_.size();
      bundle_ = std::move(kept);
      number_ = std::move(numbers);
      if (all_good) break;
    }
    fit_.coverage = coverage_of(bundle_.views, width_px_, height_px_);
  }

  LensParts all_parts() const {
    LensParts all = focal_and_centre_;
    for (const Part& part : parts_of(kind_)) all = with(all, part);
    return all;
  }

  // Focal length, centre and the first two terms: enough to tell a bad board from a good one.
  LensParts with_some() const {
    LensParts parts = focal_and_centre_;
    parts[4] = parts[5] = true;
    return parts;
  }

  // Takes up one part after the other while it explains more than chance does.
  void choose_parts() {
    bundle_.lens.distortion.setZero();
    parts_ = focal_and_centre_;
    residue_ = adjust_lens(bundle_, parts_, kManySteps);
    std::vector<Part> open = parts_of(kind_);
    while (!open.empty()) {
      // Terms of a polynomial come in their order; what is not radial may be looked at at any time.
      std::size_t best = open.size();
      LensBundle best_bundle;
      LensResidue best_residue;
      double most = 0.0;
      bool radial_seen = false;
      for (std::size_t i = 0; i < open.size(); ++i) {
        const bool radial = open[i].of.size() == 1;
        if (radial && radial_seen) continue;
        radial_seen = radial_seen || radial;
        LensBundle trial = bundle_;
        LensResidue then = adjust_lens(trial, with(parts_, open[i]), kManySteps);
        const double gain = significance(then) / static_cast<double>(open[i].of.size());
        if (gain <= most) continue;
        most = gain;
        best = i;
        best_bundle = std::move(trial);
        best_residue = std::move(then);
      }
      if (best == open.size() || most < kSignificant || !reaches(open[best])) break;
      parts_ = with(parts_, open[best]);
      bundle_ = std::move(best_bundle);
      residue_ = std::move(best_residue);
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(best));
    }
    for (const Part& part : open) {
      fit_.not_claimed.push_back(fmt::format(
          "{}: {}", part.name,
          reaches(part) ? std::string("explains no more than chance does")
                        : fmt::format("boards reach only {:.0f} % of the way to the corners, it needs {:.0f} %",
                                      100.0 * fit_.coverage.reach, 100.0 * kBorderReach)));
    }
    fit_.claimed = parts_;
    fit_.rms_px = residue_.rms_px();
  }

  // The last term of the polynomial grows at the border alone.
  bool reaches(const Part& part) const {
    const int last = kind_ == LensKind::Fisheye ? 7 : 8;
    return part.of.front() != last || fit_.coverage.reach >= kBorderReach;
  }

  double variance(const LensResidue& residue) const {
    const double unknowns = static_cast<double>(parts_.count()) + 6.0 * static_cast<double>(bundle_.views.size());
    return residue.sum_px2 / std::max(1.0, 2.0 * static_cast<double>(residue.points) - unknowns);
  }

  double significance(const LensResidue& then) const {
    return (residue_.sum_px2 - then.sum_px2) / std::max(1e-12, variance(then));
  }

  Status check_fit() {
    fit_.coverage.tilt_rad = widest_tilt(bundle_.camera_from_board);
    const double tilt_deg = fit_.coverage.tilt_rad / kDegree;
    if (bundle_.views.size() < kLeastViews) {
      return refuse(
          fmt::format("only {} boards fit one lens, {} do not; is the board flat, and are columns, rows and "
                      "the kind of lens right?",
                      bundle_.views.size(), fit_.left_out.size()));
    }
    const auto unit = lens_covariance(bundle_, parts_);
    const LensMatrix covariance = unit ? LensMatrix(variance(residue_) * *unit) : LensMatrix(LensMatrix::Zero());
    fit_.sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const double focal = std::max(fit_.sigma[0] / bundle_.lens.fx_px, fit_.sigma[1] / bundle_.lens.fy_px);
    if (!unit || fit_.coverage.tilt_rad < kLeastTilt_rad || focal > kMostFocalSigma) {
      return refuse(
          fmt::format("the focal length is not told{}: boards differ by {:.0f} degrees at most; tilt the board "
                      "by 30 degrees and more, to all sides",
                      unit ? fmt::format(" but to +-{:.2f} %", 100.0 * focal) : std::string(), tilt_deg));
    }
    const double centre = std::max(fit_.sigma[2], fit_.sigma[3]) / width_px_;
    if (centre > kMostCentreSigma) {
      return refuse(
          fmt::format("the optical centre is told only to +-{:.0f} px; tilt the board more, to all sides, and "
                      "show it in all of the image",
                      centre * width_px_));
    }
    if (fit_.rms_px > kWorstFit_px) {
      return refuse(
          fmt::format("the best lens misses the corners by {:.1f} px rms, expected {:.0f} at most; is this the "
                      "right kind of lens (--fisheye), and is the board flat?",
                      fit_.rms_px, kWorstFit_px));
    }
    // A part that is left at 0 is not known to be 0: what it may do to the rays counts.
    const auto all = lens_covariance(bundle_, all_parts());
    const MappingSigma sure = rate_mapping(bundle_, all ? LensMatrix(variance(residue_) * *all) : covariance, width_px_,
                                           height_px_, fit_.coverage.reach);
    fit_.corner_sigma_px = all ? sure.corner_px : std::numeric_limits<double>::infinity();
    fit_.rim_sigma_px = sure.rim_px;
    return {};
  }

  int width_px_;
  int height_px_;
  LensKind kind_;
  LensBundle bundle_;
  std::vector<std::size_t> number_;  // of each view of the bundle among those that were given
  LensParts focal_and_centre_;
  LensParts parts_;
  LensResidue residue_;
  LensFit fit_;
};

}  // namespace

LensCoverage coverage_of(const std::vector<BoardView>& views, int width_px, int height_px) {
  LensCoverage coverage;
  const Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1));
  std::vector<double> reach;
  const auto field = [](double at, int size) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>((at + 0.5) * kLensFields / size), 0, kLensFields - 1));
  };
  for (const BoardView& view : views) {
    for (const Vector2d& px : view.seen_px) {
      ++coverage.corners[field(px.y(), height_px) * kLensFields + field(px.x(), width_px)];
      reach.push_back((px - middle).norm() / middle.norm());
    }
  }
  const auto covered = std::ranges::count_if(coverage.corners, [](int corners) { return corners > 0; });
  coverage.share = static_cast<double>(covered) / static_cast<double>(coverage.corners.size());
  if (reach.empty()) return coverage;
  // One corner far out tells nothing; the farthest hundredth does.
  const auto at = reach.end() - 1 - static_cast<std::ptrdiff_t>(reach.size() / 100);
  std::nth_element(reach.begin(), at, reach.end());
  coverage.reach = *at;
  return coverage;
}

Result<LensFit> fit_lens(const std::vector<BoardView>& views, int width_px, int height_px, LensKind kind) {
  return LensFitter(views, width_px, height_px, kind).fit();
}

}  // namespace mocap::calibration
