#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include "associate/predicted/ray_assignments.h"
#include "associate/rays/ray_bins.h"
#include "associate/rays/view_rays.h"

namespace mocap::associate {

/// Where one view should see each expected marker, a column for each number so that loops over them run several at a
/// time. In single precision: to a thousandth of a pixel.
struct PredictedMeasurements {
  std::vector<float> x, y;                             ///< on the image plane at distance 1
  std::vector<float> xx, xy, yy;                       ///< covariance of that place
  std::vector<float> depth_m;                          ///< in front of the camera's plane; not over 0: not to be seen
  std::vector<std::int32_t> left, right, top, bottom;  ///< its gate, as RayBins::Gate

  void resize(std::size_t markers) {
    for (auto* column : {&x, &y, &xx, &xy, &yy, &depth_m}) column->resize(markers);
    for (auto* column : {&left, &right, &top, &bottom}) column->resize(markers);
  }
  Eigen::Vector2d centre(std::size_t marker) const { return Eigen::Vector2f(x[marker], y[marker]).cast<double>(); }
  /// Standard deviation, mean of both axes.
  double sigma_px(std::size_t marker, double focal_px) const {
    return focal_px * std::sqrt(0.5 * static_cast<double>(xx[marker] + yy[marker]));
  }
  bool usable(std::size_t marker) const { return depth_m[marker] > kMinDepth_m; }

  static constexpr float kMinDepth_m = 0.05F;
};

/// Finds the expected markers that are one blob together in a view. Never allocates after construction.
///
/// A marker that has no ray of its own in the view, and should be within a blob, may be the other half of it. Markers
/// are believed to share a blob when their foreseen places have the blob's centroid as their mean, and lie as far from
/// it as the blob's shape tells. Each of them then is as far from the centroid as the shape tells, on the side on which
/// it is foreseen: neighbours are foreseen with about the same error, so that this is far surer than their places.
class MergedBlobResolver {
 public:
  explicit MergedBlobResolver(std::size_t max_markers);

  /// `bins` are of the view's rays, `predicted` is by marker. Says whether any blob has more than one holder now.
  bool resolve(const ViewRays& view, const RayBins& bins, const PredictedMeasurements& predicted,
               RayAssignments& assigned);

 private:
  static constexpr std::size_t kMaxMergedMarkers = 5;
  struct MergeCandidate {
    std::uint32_t ray;
    std::uint32_t marker;
  };
  struct Group {
    std::array<std::uint32_t, kMaxMergedMarkers> markers{};
    std::size_t size = 0;
    bool has_assigned = false;
  };

  // What the blob that a group wishes for tells.
  struct BlobShape {
    Eigen::Vector2d centroid;  // on the image plane at distance 1
    Eigen::Vector2d axis;      // as ViewRays::axis
    double spread_px;
  };

  struct Layout {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();         // on the image plane at distance 1
    Eigen::Vector2d stretch_px2 = Eigen::Vector2d::Zero();  // elongation, mean over the markers
    double length_px = 0.0;                                 // root of its magnitude
    double sigma_px = 0.0;                                  // of a foreseen place, mean
  };

  // Which markers of a group explain its blob, a bit each, and how they are foreseen to lie.
  struct SubsetFit {
    std::uint32_t subset = 0;
    Layout layout;
  };

  void gather_merge_candidates(const ViewRays& view, const RayBins& bins, const PredictedMeasurements& predicted,
                               const RayAssignments& assigned);
  static Group group_of(std::span<const MergeCandidate> merge_candidates, const RayAssignments& assigned);
  static Layout layout_of(const ViewRays& view, const PredictedMeasurements& predicted, const Group& group,
                          std::uint32_t subset);
  static SubsetFit best_subset(const ViewRays& view, const PredictedMeasurements& predicted, const BlobShape& measured,
                               const Group& group);
  static void split(const ViewRays& view, const PredictedMeasurements& predicted, RayAssignments& assigned,
                    std::uint32_t ray, const BlobShape& measured, const Group& group, const SubsetFit& fit);
  static bool assign_occluded(const PredictedMeasurements& predicted, RayAssignments& assigned, std::uint32_t ray,
                              const Group& group, double focal_px);

  std::vector<MergeCandidate> merge_candidates_;
};

}  // namespace mocap::associate
