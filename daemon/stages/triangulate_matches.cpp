#include "stages/triangulate_matches.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "geometry/ray_caster.h"
#include "geometry/ray_quadric.h"
#include "geometry/triangulation.h"
#include "stages/blob_doubt.h"
#include "stages/rig_error.h"

namespace mocap::stages {
namespace {

// What the rig is taken to be off at first; a rig that is worse shows it within a second.
constexpr double kFirstError_px = 0.02;
constexpr std::size_t kLearnFrom = 4;  // markers a set
constexpr std::size_t kMany = 4;       // views, which tell what one of them is off

double off_px(const geometry::QuadricSighting& sighting, const WorldPoint& point) {
  const Eigen::Vector3d& p = point.v;
  const auto& q = sighting.quadric->q;
  const double squares = q[0] * p.x() * p.x() + q[1] * p.y() * p.y() + q[2] * p.z() * p.z() + q[3];
  const double products = q[4] * p.x() * p.y() + q[5] * p.y() * p.z() + q[6] * p.z() * p.x();
  const double ends = q[8] * p.x() + q[9] * p.y() + q[10] * p.z();
  const double sum = std::max(0.0, squares + 2.0 * (products + ends));  // rounding may leave less than nothing
  return sighting.sigma_px * std::sqrt(sum) / sighting.depth->dot(p.homogeneous());
}

class MatchTriangulator final : public Triangulator {
 public:
  MatchTriangulator(const TriangulateSettings& settings, Rig rig)
      : settings_(settings),
        agreement_{settings.agree_sigmas * settings.calibration_px, settings.agree_sigmas},
        rig_(std::move(rig)),
        error_(settings.calibration_px, rig_.size(), kFirstError_px) {
    for (const CameraModel& camera : rig_) rows_.emplace_back(camera.camera_from_world);
  }

  const Markers& triangulate(const FrameSet& frames, const Matches& matches) override {
    markers_.clear();
    // Some markers a set, each in its turn: the rig changes slowly.
    const std::size_t step = std::max<std::size_t>(1, matches.matches.size() / kLearnFrom);
    ++turn_;
    for (std::size_t m = 0; m < matches.matches.size(); ++m) {
      const auto agreed = point_of(frames, matches.matches.data()[m]);
      if (!agreed || !is_sure(agreed->refined.covariance_m2)) continue;
      if (agreed->kept >= kMany && !told_.empty() && (m + turn_) % step == 0) learn_error(frames, *agreed);
      markers_.push_back({agreed->refined.point, agreed->refined.covariance_m2, agreed->refined.rms_px,
                          static_cast<std::uint32_t>(agreed->kept), static_cast<std::uint32_t>(m),
                          matches.matches[m].expected, matches.matches[m].by_blob_tracks});
    }
    return markers_;
  }

 private:
  // By what the matcher tells of the rays, or by the blobs themselves.
  Result<geometry::Agreed, geometry::TriangulationFailure> point_of(const FrameSet& frames, const Match& match) {
    if (match.start && gather_told(frames, match)) return geometry::agree(told_, *match.start, agreement_);
    told_.clear();
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
      const auto sigma_px = static_cast<double>(seen.sigma_px);
      const double rig_px = error_.px(camera);
      const double trust = sigma_px * sigma_px / (sigma_px * sigma_px + rig_px * rig_px);
      told_.push_back({seen.quadric, &rows_[camera].depth, sigma_px, trust, seen.view});
    }
    return true;
  }

  void learn_error(const FrameSet& frames, const geometry::Agreed& agreed) {
    for (std::size_t i = 0; i < agreed.kept; ++i) {
      const geometry::QuadricSighting& sighting = told_[i];
      error_.learn(frames.views[sighting.source]->camera.value, off_px(sighting, agreed.refined.point),
                   sighting.sigma_px, agreed.kept);
    }
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
  RigError error_;
  std::size_t turn_ = 0;                    // counts the sets
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
