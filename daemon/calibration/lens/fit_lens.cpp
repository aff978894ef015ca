#include "calibration/lens/fit_lens.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/lens/lens_quality.h"
#include "calibration/robust_statistics.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
// Bounds of what a fit needs and of its work. Chosen by hand; not yet measured.
constexpr std::size_t kMinViews = 6;
constexpr std::size_t kMinPoints = 100;
constexpr int kMaxIterations = 60;
constexpr int kRejectionRounds = 3;
constexpr std::size_t kStartViews = 12;
// A view with a larger multiple of the median rms was detected wrongly, or the board is not flat. Chosen by hand; not
// yet measured.
constexpr double kOutlierViewRatio = 3.5;
// Largest relative standard deviation of the focal length: 20 times the 0.02 % that are 1 mm at 5 m.
constexpr double kMaxFocalSigma = 0.004;
constexpr double kMaxCentreSigma = 0.01;      // of the principal point, as a fraction of the image width
constexpr double kMinReach = 0.5;             // of the boards, as LensCoverage::reach
constexpr double kMinReachOfLastTerm = 0.75;  // the last term of the polynomial grows near the image corners only
constexpr double kMinTilt_rad = 12.0 * kDegree;
// Chi-square threshold, 1 degree of freedom, 99.95 %: noise explains a term by chance once in 2000 fits.
constexpr double kSignificance = 12.0;
constexpr double kMaxRms_px = 3.0;

struct DistortionTerm {
  const char* name;
  std::vector<int> columns;  // among the nine intrinsic parameters
};

std::vector<DistortionTerm> distortion_terms(LensKind kind) {
  if (kind == LensKind::Fisheye) return {{"k1", {4}}, {"k2", {5}}, {"k3", {6}}, {"k4", {7}}};
  return {{"k1", {4}}, {"k2", {5}}, {"p1 and p2", {6, 7}}, {"k3", {8}}};
}

IntrinsicMask with_term(IntrinsicMask mask, const DistortionTerm& term) {
  for (const int column : term.columns) mask[column] = true;
  return mask;
}

Error refusal(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

double largest_tilt(const std::vector<CameraFromWorld>& poses) {
  double largest = 0.0;
  for (std::size_t a = 0; a < poses.size(); ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const double cosine = std::abs(poses[a].rotation.col(2).dot(poses[b].rotation.col(2)));
      largest = std::max(largest, std::acos(std::min(1.0, cosine)));
    }
  }
  return largest;
}

/// The steps of fit_lens for one camera.
class LensFitter {
 public:
  LensFitter(const std::vector<BoardView>& views, int width_px, int height_px, LensKind kind)
      : width_px_(width_px), height_px_(height_px), kind_(kind) {
    bundle_.views = views;
    fit_.coverage = coverage_of(views, width_px, height_px);
    base_mask_ = IntrinsicMask::Constant(false);
    base_mask_.head<4>() = true;
  }

  Result<LensFit> fit() {
    if (const Status enough = check_views(); !enough) return enough.error();
    if (!initialise())
      return refusal("no lens fits the boards; check the number of columns and rows, and the kind of lens");
    reject_views();
    select_terms();
    if (const Status good = check_fit(); !good) return good.error();
    fit_.heldout_px = cross_validate(bundle_, mask_);
    fit_.lens = bundle_.lens;
    fit_.views = bundle_.views.size();
    return std::move(fit_);
  }

 private:
  Status check_views() const {
    std::size_t points = 0;
    for (const BoardView& view : bundle_.views) points += view.seen_px.size();
    if (bundle_.views.size() < kMinViews || points < kMinPoints) {
      return refusal(
          fmt::format("the board was found in {} images with {} corners, expected at least {} images and {} corners; "
                      "show it at more positions and angles",
                      bundle_.views.size(), points, kMinViews, kMinPoints));
    }
    if (fit_.coverage.reach < kMinReach) {
      return refusal(
          fmt::format("boards reach only {:.0f} % of the distance from the image centre to its corners, expected at "
                      "least {:.0f} %; show the board near the image border, too",
                      100.0 * fit_.coverage.reach, 100.0 * kMinReach));
    }
    return {};
  }

  Lens guess_lens(double view_rad) const {
    Lens lens;
    lens.kind = kind_;
    const double half = 0.5 * view_rad;
    lens.fx_px = 0.5 * width_px_ / (kind_ == LensKind::Fisheye ? half : std::tan(half));
    lens.fy_px = lens.fx_px;
    lens.cx_px = 0.5 * (width_px_ - 1);
    lens.cy_px = 0.5 * (height_px_ - 1);
    return lens;
  }

  // Tries several fields of view and takes the one with the smallest residual.
  bool initialise() {
    const std::vector<double> pinhole{20.0, 35.0, 50.0, 70.0, 100.0};
    const std::vector<double> fisheye{60.0, 90.0, 120.0, 150.0, 180.0};
    IntrinsicMask rough = IntrinsicMask::Constant(false);
    rough[0] = rough[1] = rough[4] = true;
    double best = std::numeric_limits<double>::infinity();
    LensBundle found;
    for (const double degrees : kind_ == LensKind::Fisheye ? fisheye : pinhole) {
      LensBundle trial;
      trial.lens = guess_lens(degrees * kDegree);
      const std::size_t step = std::max<std::size_t>(1, bundle_.views.size() / kStartViews);
      for (std::size_t v = 0; v < bundle_.views.size(); v += step) {
        const auto pose = estimate_board_pose(bundle_.views[v], trial.lens);
        if (!pose) continue;
        trial.views.push_back(bundle_.views[v]);
        trial.camera_from_board.push_back(*pose);
      }
      if (trial.views.size() < 3) continue;
      const LensResidual residual = adjust_lens(trial, rough, kMaxIterations);
      if (residual.rms_px() >= best) continue;
      best = residual.rms_px();
      found = std::move(trial);
    }
    if (!std::isfinite(best)) return false;
    return estimate_all_poses(found.lens);
  }

  // Estimates the poses of all boards with the initial lens; boards without a pose are left out.
  bool estimate_all_poses(const Lens& lens) {
    LensBundle all;
    all.lens = lens;
    for (std::size_t v = 0; v < bundle_.views.size(); ++v) {
      const auto pose = estimate_board_pose(bundle_.views[v], lens);
      if (!pose) {
        fit_.left_out.push_back(v);
        continue;
      }
      all.views.push_back(std::move(bundle_.views[v]));
      all.camera_from_board.push_back(*pose);
      view_index_.push_back(v);
    }
    bundle_ = std::move(all);
    return bundle_.views.size() >= kMinViews;
  }

  void reject_views() {
    for (int round = 0; round < kRejectionRounds; ++round) {
      const LensResidual residual = adjust_lens(bundle_, rejection_mask(), kMaxIterations);
      const double limit = kOutlierViewRatio * median(residual.view_rms_px);
      LensBundle remaining;
      remaining.lens = bundle_.lens;
      std::vector<std::size_t> indices;
      for (std::size_t v = 0; v < bundle_.views.size(); ++v) {
        if (residual.view_rms_px[v] > limit) {
          fit_.left_out.push_back(view_index_[v]);
          continue;
        }
        remaining.views.push_back(std::move(bundle_.views[v]));
        remaining.camera_from_board.push_back(bundle_.camera_from_board[v]);
        indices.push_back(view_index_[v]);
      }
      const bool all_good = indices.size() == view_index_.size();
      bundle_ = std::move(remaining);
      view_index_ = std::move(indices);
      if (all_good) break;
    }
    fit_.coverage = coverage_of(bundle_.views, width_px_, height_px_);
  }

  IntrinsicMask full_mask() const {
    IntrinsicMask all = base_mask_;
    for (const DistortionTerm& term : distortion_terms(kind_)) all = with_term(all, term);
    return all;
  }

  // Focal length, principal point, k1 and k2: enough to distinguish an outlier view from the others.
  IntrinsicMask rejection_mask() const {
    IntrinsicMask mask = base_mask_;
    mask[4] = mask[5] = true;
    return mask;
  }

  // Forward selection of the distortion terms by the significance of their residual decrease.
  void select_terms() {
    bundle_.lens.distortion.setZero();
    mask_ = base_mask_;
    residual_ = adjust_lens(bundle_, mask_, kMaxIterations);
    std::vector<DistortionTerm> candidates = distortion_terms(kind_);
    while (!candidates.empty()) {
      // The terms of the radial polynomial are tried in their order, the tangential term at any time.
      std::size_t best = candidates.size();
      LensBundle best_bundle;
      LensResidual best_residue;
      double most = 0.0;
      bool radial_seen = false;
      for (std::size_t i = 0; i < candidates.size(); ++i) {
        const bool radial = candidates[i].columns.size() == 1;
        if (radial && radial_seen) continue;
        radial_seen = radial_seen || radial;
        if (!is_in_reach(candidates[i])) continue;
        LensBundle trial = bundle_;
        LensResidual refitted = adjust_lens(trial, with_term(mask_, candidates[i]), kMaxIterations);
        const double gain = significance(refitted) / static_cast<double>(candidates[i].columns.size());
        if (gain <= most) continue;
        most = gain;
        best = i;
        best_bundle = std::move(trial);
        best_residue = std::move(refitted);
      }
      if (best == candidates.size() || most < kSignificance) break;
      mask_ = with_term(mask_, candidates[best]);
      bundle_ = std::move(best_bundle);
      residual_ = std::move(best_residue);
      candidates.erase(candidates.begin() + static_cast<std::ptrdiff_t>(best));
    }
    for (const DistortionTerm& term : candidates) {
      fit_.not_estimated.push_back(
          fmt::format("{}: {}", term.name,
                      is_in_reach(term)
                          ? std::string("does not explain more than noise does")
                          : fmt::format("boards reach only {:.0f} % of the distance to the corners, expected {:.0f} %",
                                        100.0 * fit_.coverage.reach, 100.0 * kMinReachOfLastTerm)));
    }
    fit_.estimated = mask_;
    fit_.rms_px = residual_.rms_px();
  }

  // Whether boards are near enough to the image corners for this term.
  bool is_in_reach(const DistortionTerm& term) const {
    const int last = kind_ == LensKind::Fisheye ? 7 : 8;
    return term.columns.front() != last || fit_.coverage.reach >= kMinReachOfLastTerm;
  }

  double variance(const LensResidual& residual) const {
    const double unknowns = static_cast<double>(mask_.count()) + 6.0 * static_cast<double>(bundle_.views.size());
    return residual.sum_px2 / std::max(1.0, 2.0 * static_cast<double>(residual.points) - unknowns);
  }

  double significance(const LensResidual& refitted) const {
    return (residual_.sum_px2 - refitted.sum_px2) / std::max(1e-12, variance(refitted));
  }

  Status check_fit() {
    fit_.coverage.tilt_rad = largest_tilt(bundle_.camera_from_board);
    const double tilt_deg = fit_.coverage.tilt_rad / kDegree;
    if (bundle_.views.size() < kMinViews) {
      return refusal(
          fmt::format("only {} boards are consistent with one lens, {} are not; check that the board is flat, and the "
                      "number of columns and rows and the kind of lens",
                      bundle_.views.size(), fit_.left_out.size()));
    }
    const auto unit = lens_covariance(bundle_, mask_);
    const IntrinsicMatrix covariance =
        unit ? IntrinsicMatrix(variance(residual_) * *unit) : IntrinsicMatrix(IntrinsicMatrix::Zero());
    fit_.sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    const double focal = std::max(fit_.sigma[0] / bundle_.lens.fx_px, fit_.sigma[1] / bundle_.lens.fy_px);
    if (!unit || fit_.coverage.tilt_rad < kMinTilt_rad || focal > kMaxFocalSigma) {
      return refusal(fmt::format(
          "the focal length is not determined{}: the angles of the boards differ by {:.0f} degrees at most; "
          "tilt the board by 30 degrees and more, to all sides",
          unit ? fmt::format(" better than +-{:.2f} %", 100.0 * focal) : std::string(), tilt_deg));
    }
    const double centre = std::max(fit_.sigma[2], fit_.sigma[3]) / width_px_;
    if (centre > kMaxCentreSigma) {
      return refusal(
          fmt::format("the principal point is determined only to +-{:.0f} px; tilt the board more, to all sides, and "
                      "show it in all parts of the image",
                      centre * width_px_));
    }
    if (fit_.rms_px > kMaxRms_px) {
      return refusal(
          fmt::format("the best lens has a residual of {:.1f} px rms, expected at most {:.0f}; check the kind of lens "
                      "(--fisheye) and that the board is flat",
                      fit_.rms_px, kMaxRms_px));
    }
    // A term that stays 0 is not known to be 0: its variance counts, too. decisions/0002.
    const auto all = lens_covariance(bundle_, full_mask());
    const MappingUncertainty mapping =
        mapping_uncertainty(bundle_, all ? IntrinsicMatrix(variance(residual_) * *all) : covariance, width_px_,
                            height_px_, fit_.coverage.reach);
    fit_.corner_sigma_px = all ? mapping.corner_px : std::numeric_limits<double>::infinity();
    fit_.rim_sigma_px = mapping.rim_px;
    return {};
  }

  int width_px_;
  int height_px_;
  LensKind kind_;
  LensBundle bundle_;
  std::vector<std::size_t> view_index_;  // index among the given views of each view of the bundle
  IntrinsicMask base_mask_;
  IntrinsicMask mask_;
  LensResidual residual_;
  LensFit fit_;
};

}  // namespace

LensCoverage coverage_of(const std::vector<BoardView>& views, int width_px, int height_px) {
  LensCoverage coverage;
  const Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1));
  std::vector<double> reach;
  const auto cell = [](double at, int size) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>((at + 0.5) * kImageCells / size), 0, kImageCells - 1));
  };
  for (const BoardView& view : views) {
    for (const Vector2d& px : view.seen_px) {
      ++coverage.corners[cell(px.y(), height_px) * kImageCells + cell(px.x(), width_px)];
      reach.push_back((px - middle).norm() / middle.norm());
    }
  }
  const auto covered = std::ranges::count_if(coverage.corners, [](int corners) { return corners > 0; });
  coverage.share = static_cast<double>(covered) / static_cast<double>(coverage.corners.size());
  if (reach.empty()) return coverage;
  const auto at = reach.end() - 1 - static_cast<std::ptrdiff_t>(reach.size() / 100);
  std::nth_element(reach.begin(), at, reach.end());
  coverage.reach = *at;
  return coverage;
}

Result<LensFit> fit_lens(const std::vector<BoardView>& views, int width_px, int height_px, LensKind kind) {
  return LensFitter(views, width_px, height_px, kind).fit();
}

}  // namespace mocap::calibration
