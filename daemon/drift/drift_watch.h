#pragma once

#include <Eigen/Core>
#include <bitset>
#include <optional>
#include <vector>

#include "drift/drift_settings.h"
#include "model/camera_model.h"
#include "model/sighting.h"

namespace mocap::drift {

/// How a camera stands against what the rig says, as the other cameras see it.
struct CameraDrift {
  bool drifted = false;
  double off_px = 0.0;  ///< rms over its views, of what a turn and a move of it explain
  double rms_px = 0.0;  ///< rms of its views, each axis, whatever explains it
  double turned_rad = 0.0;
  double moved_m = 0.0;
  double views = 0.0;                 ///< that this is told by
  CameraFromWorld camera_from_world;  ///< where it seems to stand
};

/// Watches while capturing whether every camera still stands where the rig says. Markers that three other cameras agree
/// on tell where a camera should see them; of what it sees instead, the turn and the move that explain most are kept as
/// a running least-squares problem of six unknowns. A bumped camera's blobs lie outside of the matcher's gates, so
/// blobs that no match has are looked at, too, where just one is near.
///
/// Needs four cameras. One thread; reads no clock, never allocates after construction; the work for a set is bounded.
class DriftWatch {
 public:
  DriftWatch(const DriftSettings& settings, Rig rig);

  /// Sets come in the order of their exposure. Gives the camera that was assessed anew.
  CameraId update(const FrameSet& frames, const Matches& matches, const Markers& markers);

  const CameraDrift& camera(CameraId camera) const { return cameras_[camera.value].drift; }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;

  struct Camera {
    Matrix6 normal_matrix = Matrix6::Zero();
    Vector6 gradient = Vector6::Zero();
    double residual_sum = 0.0;
    double views = 0.0;
    CameraDrift drift;
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
  std::vector<std::bitset<kMaxBlobs>> matched_;  // by view: blobs that matches have
  std::optional<Timestamp> updated_at_;
  std::size_t next_marker_ = 0;
  std::size_t next_camera_ = 0;
};

}  // namespace mocap::drift
