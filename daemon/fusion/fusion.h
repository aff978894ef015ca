#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "base/bounded_vector.h"
#include "drift/drift_watch.h"
#include "model/sighting.h"
#include "model/snapshot.h"
#include "module/labeller.h"
#include "module/marker_tracker.h"
#include "module/matcher.h"
#include "module/skeleton_solver.h"
#include "module/triangulator.h"
#include "solve/subject_refiner.h"

namespace mocap::fusion {

/// The parts of the row from blobs to skeleton.
struct FusionParts {
  std::unique_ptr<Matcher> matcher;
  std::unique_ptr<Triangulator> triangulator;
  std::unique_ptr<MarkerTracker> tracker;
  std::unique_ptr<Labeller> labeller;
  std::unique_ptr<SkeletonSolver> solver;
  std::unique_ptr<solve::SubjectRefiner> refiner;  ///< none: bodies stay as they were recognised
  std::unique_ptr<drift::DriftWatch> drift;        ///< none: nobody looks whether the rig is still right
};

/// The whole row: one instant's blobs to one snapshot. What it believes of the markers, names and bodies lives from
/// set to set, so that the next set starts from where each known marker should be.
///
/// One thread. Reads no clock and allocates nothing: the same sets give the same snapshots.
class Fusion {
 public:
  /// `camera_count`: cameras of the configuration, of which a complete set has all.
  Fusion(FusionParts parts, std::uint32_t camera_count);

  /// Sets come in the order of their exposure. The snapshot is borrowed until the next call; of its instants, those
  /// up to `detected_at` are set.
  Snapshot& step(const FrameSet& frames);

  /// Somebody else fitted this subject: worn from the next step on. Offsets by bone and by marker, as the subject has.
  void refit(const SubjectFit& fit);
  /// As Labeller says.
  void reset(SubjectId subject);
  void set_away(SubjectId subject, bool away) { parts_.labeller->set_away(subject, away); }

  /// The fit of a subject that the last step began to use, with the description version that its snapshot bears.
  const std::optional<SubjectFit>& fit() const noexcept { return fit_; }

  /// The camera that was looked at anew in the last step, how it stands; null where nobody looks.
  const drift::CameraDrift* drift() const noexcept { return parts_.drift ? &parts_.drift->camera(assessed_) : nullptr; }
  CameraId assessed() const noexcept { return assessed_; }

 private:
  struct TrackLabel {
    TrackId track;
    Label label;
  };
  struct RetainedLabel : TrackLabel {
    Timestamp seen_at;  // by one camera
  };

  const Expected& expect(Timestamp at);
  void label_predictions();
  void label_bearings(const FrameSet& frames, const Matches& matches);
  void retain_hidden_labels(const Matches& matches);
  void learn_fit();
  void update_track_labels();
  void describe_views(const FrameSet& frames);
  void append_unlabelled(const TrackedMarkers& tracked);

  FusionParts parts_;
  Expected expected_;
  Expected body_predictions_;
  BoundedVector<TrackLabel, kMaxMarkers> track_labels_;  // sorted by track: who bore a name after the last step
  BoundedVector<RetainedLabel, kMaxMarkers>
      retained_;  // by track: that nobody or one camera sees, and their last names
  BoundedVector<RetainedLabel, kMaxMarkers> retained_before_;
  std::array<std::uint8_t, kMaxMarkers> view_counts_{};  // by expected marker, in this set: 0, 1, 2 or more
  LabelledBearings bearings_;
  CameraId assessed_{0};  // by the drift watch
  std::optional<SubjectFit> fit_;
  std::optional<SubjectFit> pending_fit_;  // after the last set, to be worn from this one on
  Snapshot snapshot_;
};

}  // namespace mocap::fusion
