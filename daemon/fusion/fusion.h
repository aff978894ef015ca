#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/bounded_vector.h"
#include "drift/drift_watch.h"
#include "model/blob_use.h"
#include "model/bounds.h"
#include "model/handover.h"
#include "model/identity_map.h"
#include "model/search_report.h"
#include "model/sighting.h"
#include "model/snapshot.h"
#include "module/labeller.h"
#include "module/marker_tracker.h"
#include "module/matcher.h"
#include "module/skeleton_solver.h"
#include "module/triangulator.h"
#include "solve/subject_refiner.h"

namespace mocap::fusion {

/// The steps of the pipeline from blobs to skeletons. The first five are required.
struct FusionParts {
  std::unique_ptr<Matcher> matcher;
  std::unique_ptr<Triangulator> triangulator;
  std::unique_ptr<MarkerTracker> tracker;
  std::unique_ptr<Labeller> labeller;
  std::unique_ptr<SkeletonSolver> solver;
  std::unique_ptr<solve::SubjectRefiner> refiner;  ///< null: subjects keep the fit with which they were identified
  std::unique_ptr<drift::DriftWatch> drift;        ///< null: camera drift is not estimated
};

/// The pipeline from blobs to skeletons in one function: one frame set in, one snapshot out.
///
/// Reads no clock: the same sets give the same snapshots, live, in a replay and in a test. Never allocates in `step`.
/// One thread makes all calls.
class Fusion {
 public:
  /// `camera_count`: cameras of the configuration, 1 to kMaxCameras; a complete set has one view of each. The required
  /// parts must not be null.
  Fusion(FusionParts parts, std::uint32_t camera_count);

  /// Processes one set. Sets come in the order of their exposure. The snapshot is borrowed until the next call; its
  /// instants are set up to `detected_at`, the caller sets the later ones.
  Snapshot& step(const FrameSet& frames);

  /// Takes over the belief of the fusion of the configuration before, which is not used afterwards: 3D tracks, labels,
  /// poses and bodies of all that continues. The description version increases by one. Call before the first `step`;
  /// allocates.
  void adopt(Fusion& before, const Handover& handover);

  /// Writes the belief, or takes it over from a fusion that was built with the same settings, so that both give the
  /// same snapshots from then on. Call between two steps. Writing never allocates; the belief is smaller than
  /// kMostBeliefBytes (model/take/belief.h).
  void archive(Archive& members);

  /// Uses a fit of a subject that was made elsewhere, from the next step on. Fits of several subjects take as many
  /// steps.
  void refit(const SubjectFit& fit);
  /// As Labeller::reset.
  void reset(SubjectId subject);
  /// As Labeller::set_away.
  void set_away(SubjectId subject, bool away) { parts_.labeller->set_away(subject, away); }

  /// The fit of a subject that the last step began to use, with the description version of that step's snapshot.
  const std::optional<SubjectFit>& fit() const noexcept { return fit_; }

  /// Evidence of the search for a missing subject, with the views; null in most sets. Borrowed until the next step.
  const SearchReport* search() const noexcept { return search_ ? &*search_ : nullptr; }

  /// The fits in force, one for each subject that was fitted since its definition was loaded.
  const std::vector<SubjectFit>& fits() const noexcept { return fits_; }
  std::uint32_t description_version() const noexcept { return snapshot_.description_version; }

  /// The drift of the camera that the last step assessed; null without a DriftWatch.
  const drift::CameraDrift* drift() const noexcept { return parts_.drift ? &parts_.drift->camera(assessed_) : nullptr; }
  /// The camera that the last step assessed.
  CameraId assessed() const noexcept { return assessed_; }

  /// The blobs of a camera in the last step.
  const BlobUse& blob_use(CameraId camera) const noexcept { return blob_use_[camera.value]; }

 private:
  void report_search(const SearchReport* search, const FrameSet& frames, const Matches& matches,
                     const Markers& markers);
  void inform_refiner(const SubjectFit& fit);
  void drop_pending_fit(SubjectId subject);
  void add_pending_fit(const SubjectFit& fit);
  void use_fit(const std::optional<SubjectFit>& identified);
  void remember_fit();
  const LabelledBearings& label_bearings(const FrameSet& frames, const Matches& matches, const Predictions& predicted);
  void refine(const SolvedSubjects& solved, Timestamp at);
  void count_blobs(const FrameSet& frames, const Matches& matches, const Markers& markers);
  Snapshot& describe(const FrameSet& frames, const TrackedMarkers& tracked, const SolvedSubjects& solved);
  void describe_views(const FrameSet& frames);
  void describe_unlabelled(const TrackedMarkers& tracked);

  FusionParts parts_;
  IdentityMap identities_;
  LabelledBearings bearings_;
  CameraId assessed_{0};
  std::array<BlobUse, kMaxCameras> blob_use_;  // by camera, of the last step
  std::optional<SubjectFit> fit_;
  std::optional<SearchReport> search_;
  // One is used in each step, in this order; at most one for each subject.
  BoundedVector<SubjectFit, kMaxSubjects> pending_fits_;
  std::vector<SubjectFit> fits_;  // in force; at most one for each subject
  Snapshot snapshot_;
};

}  // namespace mocap::fusion
