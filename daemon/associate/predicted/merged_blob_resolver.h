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

/// The predicted measurements of all markers in one view, as columns for SIMD loops. Single precision is accurate to a
/// thousandth of a pixel.
struct PredictedMeasurements {
  std::vector<float> x, y;                             ///< on the image plane at distance 1
  std::vector<float> xx, xy, yy;                       ///< covariance of that position
  std::vector<float> depth_m;                          ///< distance in front of the plane of the camera
  std::vector<std::int32_t> left, right, top, bottom;  ///< the gate, as RayBins::Gate

  void resize(std::size_t markers) {
    for (auto* column : {&x, &y, &xx, &xy, &yy, &depth_m}) column->resize(markers);
    for (auto* column : {&left, &right, &top, &bottom}) column->resize(markers);
  }
  Eigen::Vector2d centre(std::size_t marker) const { return Eigen::Vector2f(x[marker], y[marker]).cast<double>(); }
  /// Standard deviation: root of the mean variance of both axes.
  double sigma_px(std::size_t marker, double focal_px) const {
    return focal_px * std::sqrt(0.5 * static_cast<double>(xx[marker] + yy[marker]));
  }
  /// Whether the marker is in front of the camera.
  bool usable(std::size_t marker) const { return depth_m[marker] > kMinDepthSingle_m; }
};

/// Resolves merged blobs: finds the predicted markers that form one blob together (merged measurements). Never
/// allocates after construction.
///
/// A marker without an exclusive ray whose prediction lies within a blob may be part of that blob. A group of markers
/// shares a blob if the mean of their predictions is near the centroid and their spread matches the elongation of the
/// blob. Each marker is then placed at the distance that the shape gives, on the side where it is predicted:
/// neighbouring predictions have about the same error, so their relative position is much more certain than their
/// positions.
class MergedBlobResolver {
 public:
  explicit MergedBlobResolver(std::size_t max_markers);

  /// Adds shared blobs to `assigned`. `bins` holds the rays of the view, `predicted` is by marker. Returns whether any
  /// blob is shared.
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

  // The measured shape of a merged blob.
  struct BlobShape {
    Eigen::Vector2d centroid;  // on the image plane at distance 1
    Eigen::Vector2d axis;      // as ViewRays::axis
    double spread_px;
  };

  // The predicted arrangement of the markers of a group.
  struct Layout {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();         // on the image plane at distance 1
    Eigen::Vector2d stretch_px2 = Eigen::Vector2d::Zero();  // elongation(), mean over the markers
    double length_px = 0.0;                                 // root of its norm
    double sigma_px = 0.0;                                  // mean standard deviation of the predictions
  };

  // The markers of a group that explain its blob, one bit each, and their predicted arrangement.
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
