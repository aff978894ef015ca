#include "associate/match_triangulator.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "associate/rays/centroid_uncertainty.h"
#include "associate/rig_error.h"
#include "base/expects.h"
#include "geometry/ray_caster.h"
#include "geometry/triangulation.h"

namespace mocap::associate {
namespace {

class MatchTriangulator final : public Triangulator {
 public:
  MatchTriangulator(const TriangulateSettings& settings, Rig rig)
      : settings_(settings),
        agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
        rig_(std::move(rig)),
        error_(settings.calibration_px) {}

  const Markers& triangulate(const FrameSet& frames, const Matches& matches) override {
    markers_.clear();
    // Learn the rig error from a few markers a set, in turn: the rig error changes slowly.
    const std::size_t step = std::max<std::size_t>(1, matches.matches.size() / kRigErrorMarkersPerSet);
    ++set_count_;
    for (std::size_t m = 0; m < matches.matches.size(); ++m) {
      const Match& match = matches.matches.data()[m];
      const auto agreed = point_of(frames, match);
      if (!agreed) continue;
      const BlobNoise noise = noise_of(frames, match);
      if (agreed->kept >= kMinRigErrorViews && noise.is_uniform && (m + set_count_) % step == 0) {
        error_.learn(agreed->refined.rms_px, noise.variance_px2, agreed->kept);
      }
      const Eigen::Matrix3d covariance_m2 = agreed->refined.covariance_m2 * (1.0 + error_.px2() / noise.variance_px2);
      if (!is_precise(covariance_m2)) continue;
      markers_.push_back({agreed->refined.point, covariance_m2, agreed->refined.rms_px,
                          static_cast<std::uint32_t>(agreed->kept), static_cast<std::uint32_t>(m), match.prediction,
                          match.by_blob_tracks, agreed->seen_by});
    }
    return markers_;
  }

  void archive(Archive& members) override { members(error_, set_count_); }

 private:
  // Whether the settings of this triangulator would remove no view of the point that the matcher found.
  bool satisfies_agreement(const Triangulation& found) const {
    return found.floor_px <= agreement_.floor_px && found.sigmas <= agreement_.sigmas;
  }

  // A point, the number of sightings that agree on it, and their cameras.
  struct Point {
    geometry::Refined refined;
    std::size_t kept = 0;
    CameraBits seen_by = 0;
  };

  // The point of the matcher, or the point solved from the blobs.
  std::optional<Point> point_of(const FrameSet& frames, const Match& match) {
    if (match.triangulation && satisfies_agreement(*match.triangulation)) {
      const Triangulation& found = *match.triangulation;
      Point point{{found.point, found.covariance_m2, found.rms_px}, match.sightings.size()};
      for (const BlobRef& seen : match.sightings) point.seen_by |= bit_of(frames.views[seen.view]->camera);
      return point;
    }
    gather(frames, match);
    const auto agreed = geometry::agree(sightings_, agreement_);
    if (!agreed) return std::nullopt;
    Point point{agreed->refined, agreed->kept};
    for (std::size_t i = 0; i < agreed->kept; ++i) point.seen_by |= bit_of(frames.views[sightings_[i].source]->camera);
    return point;
  }

  void gather(const FrameSet& frames, const Match& match) {
    sightings_.clear();
    for (const BlobRef& seen : match.sightings) {
      const BlobFrame& frame = *frames.views[seen.view];
      MOCAP_EXPECTS(frame.camera.value < rig_.size());
      const Blob& blob = frame.blobs[seen.blob];
      const Eigen::Vector2d off_px(seen.off_x_px, seen.off_y_px);
      const auto ray = geometry::ray_of(rig_[frame.camera.value].lens, {blob.centroid.v + off_px});
      if (!ray) continue;
      const double sigma_px = seen.sigma_px > 0.0F ? static_cast<double>(seen.sigma_px) : centroid_sigma_px(blob);
      sightings_.push_back(
          {&rig_[frame.camera.value].camera_from_world, ray->point, ray->px_from_ray, sigma_px, seen.view});
    }
  }

  // The measurement noise of the blobs of a match.
  struct BlobNoise {
    double variance_px2;  // harmonic mean
    bool is_uniform;
  };
  static BlobNoise noise_of(const FrameSet& frames, const Match& match) {
    // A match with less equal weights does not separate the rig error from blob noise. Chosen by hand; not yet
    // measured.
    constexpr double kMaxWeightRatio = 4.0;
    double sum_1_px2 = 0.0;
    float least_1_px2 = std::numeric_limits<float>::infinity();
    for (const BlobRef& seen : match.sightings) {
      const float sigma_px = seen.sigma_px > 0.0F
                                 ? seen.sigma_px
                                 : static_cast<float>(centroid_sigma_px(frames.views[seen.view]->blobs[seen.blob]));
      const float weight = 1.0F / (sigma_px * sigma_px);
      sum_1_px2 += static_cast<double>(weight);
      least_1_px2 = std::min(least_1_px2, weight);
    }
    const double mean_1_px2 = sum_1_px2 / static_cast<double>(match.sightings.size());
    return {1.0 / mean_1_px2, kMaxWeightRatio * static_cast<double>(least_1_px2) > mean_1_px2};
  }

  // Whether the standard deviation in the worst direction is small enough.
  bool is_precise(const Eigen::Matrix3d& covariance_m2) const {
    // The trace is an upper bound of the largest eigenvalue; most points pass without computing eigenvalues.
    const double most = settings_.max_sigma_m * settings_.max_sigma_m;
    if (covariance_m2.trace() < most) return true;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance_m2, Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()[2] < most;
  }

  TriangulateSettings settings_;
  geometry::Agreement agreement_;
  Rig rig_;
  PointError error_;
  std::size_t set_count_ = 0;  // number of sets so far
  BoundedVector<geometry::Sighting, kMaxCameras> sightings_;
  Markers markers_;
};

}  // namespace

std::unique_ptr<Triangulator> make_triangulator(const TriangulateSettings& settings, Rig rig) {
  MOCAP_EXPECTS(!rig.empty() && rig.size() <= kMaxCameras);
  return std::make_unique<MatchTriangulator>(settings, std::move(rig));
}

}  // namespace mocap::associate
