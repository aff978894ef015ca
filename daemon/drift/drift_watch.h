#pragma once

#include <Eigen/Core>
#include <bitset>
#include <optional>
#include <vector>

#include "base/archive.h"
#include "drift/drift_settings.h"
#include "model/camera_model.h"
#include "model/sighting.h"

namespace mocap::drift {

/// The estimated difference between the pose of a camera and its pose in the rig. Both figures in px are the rms length
/// of a residual, not of each axis, which is smaller by the square root of 2.
struct CameraDrift {
  bool drifted = false;
  double off_px = 0.0;  ///< of the reprojection error that the pose change explains
  double rms_px = 0.0;  ///< of the whole reprojection error
  double turned_rad = 0.0;
  double moved_m = 0.0;
  double views = 0.0;                 ///< weighted number of observations
  CameraFromWorld camera_from_world;  ///< the estimated pose

  void archive(Archive& members) {
    members(drifted, off_px, rms_px, turned_rad, moved_m, views, camera_from_world.rotation,
            camera_from_world.translation);
  }
};

/// Detects during capture that the pose of a camera differs from its pose in the rig.
///
/// Markers on which three or more other cameras agree are projected into each camera. The reprojection errors
/// accumulate in the normal equations of a small rotation and translation of the camera (resection by Gauss-Newton with
/// six unknowns; Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), chapter 7), with exponential forgetting
/// and the weights of a Cauchy loss. The blobs of a bumped camera lie outside the gates of the matcher; therefore an
/// unmatched blob is an observation too if it is the only blob near the projection.
///
/// Detection needs four cameras. One thread makes all calls. Reads no clock and never allocates after construction; the
/// work for one set is bounded.
class DriftWatch {
 public:
  /// `rig` has 1 to kMaxCameras cameras.
  DriftWatch(const DriftSettings& settings, Rig rig);

  /// Adds the observations of one set and assesses one camera (each in turn). Returns that camera. Sets come in the
  /// order of their exposure.
  CameraId update(const FrameSet& frames, const Matches& matches, const Markers& markers);

  /// The last assessment of a camera of the rig.
  const CameraDrift& camera(CameraId camera) const { return cameras_[camera.value].drift; }

  /// Writes what was learned, or takes it over from a watch of the same rig. Call between two sets.
  void archive(Archive& members) { members(cameras_, updated_at_, next_marker_, next_camera_); }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  // Normal equations of the pose change of one camera: rotation in rad, then translation in m, in the camera's frame.
  struct Camera {
    Matrix6 normal_matrix = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    double residual_sum = 0.0;
    double views = 0.0;
    CameraDrift drift;

    void archive(Archive& members) { members(normal_matrix, gradient, residual_sum, views, drift); }
  };

  void forget(Timestamp now);
  void mark_matched_blobs(const FrameSet& frames, const Matches& matches);
  void observe_marker(const Marker& marker, const Match& match, const FrameSet& frames);
  std::optional<Eigen::Vector2d> nearest_unmatched(const BlobFrame& view, std::size_t index, const Eigen::Vector2d& at,
                                                   double reach_px) const;
  void learn(std::size_t camera, const Eigen::Vector3d& in_camera, const Eigen::Vector2d& off_px);
  void assess(std::size_t camera);

  DriftSettings settings_;
  Rig rig_;
  std::vector<Camera> cameras_;
  std::vector<std::bitset<kMaxBlobs>> matched_;  // by view: which blobs belong to a match
  std::optional<Timestamp> updated_at_;
  std::size_t next_marker_ = 0;
  std::size_t next_camera_ = 0;
};

}  // namespace mocap::drift
