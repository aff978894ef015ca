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
struct Foreseen {
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
  bool usable(std::size_t marker) const { return depth_m[marker] > kNearest_m; }

  static constexpr float kNearest_m = 0.05F;
};

/// Finds the expected markers that are one blob together in a view. Never allocates after construction.
///
/// A marker that has no ray of its own in the view, and should be within a blob, may be the other half of it. Markers
/// are believed to share a blob when their foreseen places have the blob's centroid as their mean, and lie as far from
/// it as the blob's shape tells. Each of them then is as far from the centroid as the shape tells, on the side on which
/// it is foreseen: neighbours are foreseen with about the same error, so that this is far surer than their places.
class BlobSharer {
 public:
  explicit BlobSharer(std::size_t max_markers);

  /// `bins` are of the view's rays, `foreseen` is by marker. Says whether any blob has more than one holder now.
  bool share(const ViewRays& view, const RayBins& bins, const Foreseen& foreseen, ViewHolds& held);

 private:
  static constexpr std::size_t kMaxSharers = 5;
  struct Wish {
    std::uint32_t ray;
    std::uint32_t marker;
  };
  struct Group {
    std::array<std::uint32_t, kMaxSharers> markers{};
    std::size_t size = 0;
    bool has_owner = false;
  };

  // What the blob that a group wishes for tells.
  struct Told {
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
  struct Explained {
    std::uint32_t subset = 0;
    Layout layout;
  };

  void gather_wishes(const ViewRays& view, const RayBins& bins, const Foreseen& foreseen, const ViewHolds& held);
  static Group group_of(std::span<const Wish> wishes, const ViewHolds& held);
  static Layout layout_of(const ViewRays& view, const Foreseen& foreseen, const Group& group, std::uint32_t subset);
  static Explained best_subset(const ViewRays& view, const Foreseen& foreseen, const Told& told, const Group& group);
  static void split(const ViewRays& view, const Foreseen& foreseen, ViewHolds& held, std::uint32_t ray,
                    const Told& told, const Group& group, const Explained& explained);
  static bool overlay(const Foreseen& foreseen, ViewHolds& held, std::uint32_t ray, const Group& group,
                      double focal_px);

  std::vector<Wish> wishes_;
};

}  // namespace mocap::associate
