#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "fusion/fusion.h"
#include "lib/benchmark/point_noise.h"
#include "model/sighting.h"
#include "model/snapshot.h"
#include "settings/daemon_settings.h"

namespace mocap::benchmark {

/// The daemon's steps from 3D points to skeletons: 3D tracking, labels, solving. Points take the place of triangulated
/// markers. A point that lies where the body predicts a marker without a track is associated with that prediction, as
/// the matcher does with blobs. The same points give the same snapshots.
class PointPipeline {
 public:
  /// Standard deviation of a point, each axis, that the tracker assumes: marker error of a calibrated studio.
  static constexpr double kPointSigma_m = 0.0003;

  /// The settings outlive this object; the rig is not used.
  explicit PointPipeline(const settings::DaemonSettings& settings);
  ~PointPipeline();
  PointPipeline(const PointPipeline&) = delete;
  PointPipeline& operator=(const PointPipeline&) = delete;

  /// Processes one frame. The snapshot is valid until the next call.
  const Snapshot& step(Timestamp at, const NoisyFrame& frame);

  /// As Fusion::fit, after the last step.
  const std::optional<SubjectFit>& fit() const { return fusion_->fit(); }

  /// Predictions, 3D tracks and labelling of the last step, for explanations. Valid until the next step.
  const Predictions& predicted() const;
  const TrackedMarkers& tracked() const;
  const Labelling& labelling() const;

 private:
  class Points;
  class CutTracker;
  class ObservedLabeller;

  std::unique_ptr<Points> points_;
  CutTracker* tracker_ = nullptr;         // owned by fusion_
  ObservedLabeller* labeller_ = nullptr;  // owned by fusion_
  std::unique_ptr<fusion::Fusion> fusion_;
  std::uint64_t number_ = 0;
};

}  // namespace mocap::benchmark
