#include "stages/triangulate_matches.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "geometry/ray_caster.h"
#include "geometry/ray_quadric.h"
#include "geometry/triangulation.h"
#include "stages/blob_doubt.h"

namespace mocap::stages {
namespace {

class MatchTriangulator final : public Triangulator {
 public:
  MatchTriangulator(const TriangulateSettings& settings, Rig rig)
      : settings_(settings),
        agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
        rig_(std::move(rig)) {
    for (const CameraModel& camera : rig_) rows_.emplace_back(camera.camera_from_world);
  }

  const Markers& triangulate(const FrameSet& frames, const Matches& matches) override {
    markers_.clear();
    for (std::size_t m = 0; m < matches.matches.size(); ++m) {
      const auto agreed = point_of(frames, matches.matches.data()[m]);
      if (!agreed || !is_sure(agreed->refined.covariance_m2)) continue;
      markers_.push_back({agreed->refined.point, agreed->refined.covariance_m2, agreed->refined.rms_px,
                          static_cast<std::uint32_t>(agreed->kept), static_cast<std::uint32_t>(m),
                          matches.matches[m].expected});
    }
    return markers_;
  }

 private:
  // Whether nothing would be left out here.
  bool is_as_strict(const Meeting& met) const {
    return met.floor_px <= agreement_.floor_px && met.sigmas <= agreement_.sigmas;
  }

  // By what the matcher found, by what it tells of the rays, or by the blobs themselves.
  Result<geometry::Agreed, geometry::TriangulationFailure> point_of(const FrameSet& frames, const Match& match) {
    if (match.meeting && is_as_strict(*match.meeting)) {
      const Meeting& met = *match.meeting;
      return geometry::Agreed{{met.point, met.covariance_m2, met.rms_px}, match.sightings.size()};
    }
    if (match.start && gather_told(frames, match)) return geometry::agree(told_, *match.start, agreement_);
    gather(frames, match);
    return geometry::agree(sightings_, agreement_);
  }

  // False where a sighting does not tell its ray.
  bool gather_told(const FrameSet& frames, const Match& match) {
    told_.clear();
    for (const BlobRef& seen : match.sightings) {
      const std::uint32_t camera = frames.views[seen.view]->camera.value;
      MOCAP_EXPECTS(camera < rig_.size());
      if (seen.quadric == nullptr || !(seen.sigma_px > 0.0F)) return false;
      told_.push_back({seen.quadric, &rows_[camera].depth, static_cast<double>(seen.sigma_px), 1.0, seen.view});
    }
    return true;
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
      const double sigma_px = seen.sigma_px > 0.0F ? static_cast<double>(seen.sigma_px) : doubt_px(blob);
      sightings_.push_back(
          {&rig_[frame.camera.value].camera_from_world, ray->point, ray->px_from_ray, sigma_px, seen.view});
    }
  }

  // The standard deviation in the worst direction.
  bool is_sure(const Eigen::Matrix3d& covariance_m2) const {
    // No direction is worse than all axes together; most points pass without the eigenvalues.
    const double most = settings_.max_sigma_m * settings_.max_sigma_m;
    if (covariance_m2.trace() < most) return true;
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(covariance_m2, Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()[2] < most;
  }

  TriangulateSettings settings_;
  geometry::Agreement agreement_;
  Rig rig_;
  std::vector<geometry::CameraRows> rows_;  // by camera
  BoundedVector<geometry::Sighting, kMaxCameras> sightings_;
  BoundedVector<geometry::QuadricSighting, kMaxCameras> told_;
  Markers markers_;
};

}  // namespace

std::unique_ptr<Triangulator> make_triangulator(const TriangulateSettings& settings, Rig rig) {
  MOCAP_EXPECTS(!rig.empty() && rig.size() <= kMaxCameras);
  return std::make_unique<MatchTriangulator>(settings, std::move(rig));
}

}  // namespace mocap::stages
