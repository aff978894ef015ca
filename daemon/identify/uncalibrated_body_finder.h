#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "bodyfit/body_offsets.h"
#include "bodyfit/subject_fitter.h"
#include "identify/any_pose_finder.h"
#include "model/bounds.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// An identified body of unknown dimensions: its pose, and the dimensions fitted to one instant.
struct FoundUncalibratedBody {
  FoundPose pose;
  BoundedVector<Eigen::Vector3d, kMaxBones> rest_offsets_m;     ///< fitted, by bone
  BoundedVector<Eigen::Vector3d, kMaxLabels> marker_offsets_m;  ///< fitted, by marker
  double rms_m = 0.0;                                           ///< robust, of the points from the fitted body

  void archive(Archive& members) { members(pose, rest_offsets_m, marker_offsets_m, rms_m); }
};

/// Finds a person of unknown dimensions in any pose, from the marker set alone, in the points of one instant. The
/// markers of the person are near their places in the set (figures: decision 0008), and size and bone lengths differ.
///
/// 1. AnyPoseFinder searches for the marker set in one size, with uncertain dimensions. Each search takes the next
///    size, so that a caller who begins again with new points tries all sizes from 0.8 to 1.2.
/// 2. A bundle adjustment of this one instant fits size, bone lengths and marker offsets, with the marker set as prior
///    (bodyfit::SubjectFitter; Triggs et al. 2000).
/// 3. The fitted body, whose dimensions are less uncertain, is searched for in the same points. The points that it
///    explains are those of the result, and the dimensions are fitted to them once more.
///
/// One instant does not determine all dimensions: the bone axes follow the prior. A search can be spread over several
/// calls. Allocates in the constructor only. Equal calls give equal results.
class UncalibratedBodyFinder {
 public:
  explicit UncalibratedBodyFinder(const MarkerSet& set);

  /// Whether the set has a bone whose markers determine its rotation. Without one, a search finds nothing.
  bool can_find() const noexcept { return finder_.can_find(); }

  /// Begins a search with the next size; ends a running one without result. Uses the first kMaxCloudPoints points.
  void begin(std::span<const Eigen::Vector3d> points);
  /// Ends a running search without result.
  void stop() noexcept { stage_ = Stage::Idle; }
  bool searching() const noexcept { return stage_ != Stage::Idle; }
  /// Points of the last `begin`.
  std::size_t point_count() const noexcept { return points_.size(); }
  /// Continues the search by about `work` bone fits (about 0.5 us each). Returns true when the search has ended.
  bool advance(std::size_t work);
  /// The result of the last search; empty until that search has ended.
  const std::optional<FoundUncalibratedBody>& found() const noexcept { return found_; }

  /// Takes over all of another finder, also a search in progress. `before` is not used afterwards.
  void adopt(UncalibratedBodyFinder& before);
  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  enum class Stage { Idle, Search, Fit, Confirm, FinalFit };

  std::size_t step(std::size_t work);
  void fit(Stage stage);
  void confirm();
  void describe();

  MarkerSet set_;
  AnyPoseFinder finder_;
  bodyfit::SubjectFitter fitter_;
  std::vector<bodyfit::BodyInstant> instants_;  // one
  bodyfit::BodyOffsets offsets_;                // of the body in work
  double size_ = 1.0;                           // of that body, relative to the set
  std::size_t next_size_ = 0;
  std::vector<Eigen::Vector3d> points_;
  Stage stage_ = Stage::Idle;
  std::optional<FoundPose> pose_;  // of the last search of the finder
  std::optional<FoundUncalibratedBody> found_;
};

}  // namespace mocap::identify
