#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <vector>

#include "associate/rays/batch_projector.h"
#include "associate/rays/listed_rays.h"
#include "associate/rays/ray_bins.h"
#include "geometry/ray_caster.h"
#include "geometry/ray_quadric.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/sighting.h"

namespace mocap::associate {

/// A marker nearer to the plane of the camera is not in front of the camera: no lens focuses at a shorter distance. The
/// single-precision copy is for SIMD loops.
inline constexpr double kMinDepth_m = 0.05;
inline constexpr float kMinDepthSingle_m = 0.05F;

/// The first-order projection of a Gaussian: mean and covariance on the image plane at distance 1.
struct ProjectedGaussian {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// The rays of one view, in the order of its blobs, as columns.
struct ViewRays {
  const CameraModel* camera = nullptr;
  const geometry::CameraRows* rows = nullptr;  ///< of the projection matrix of the camera
  double focal_px = 1.0;
  geometry::RayColumns rays{kMaxBlobs};
  std::vector<geometry::RayQuadric> quadric;  ///< weighted by sigma_px; valid only for rays whose quadric was made
  std::vector<double> sigma_px;               ///< of the blob's centroid, including the uncertainty from its shape
  std::vector<double> spread_px;    ///< 0, or the distance of several markers from the centroid of their merged blob
  std::vector<double> axis_rad;     ///< direction of the longer axis, if the spread is not 0; NaN: unknown
  std::vector<std::uint16_t> blob;  ///< index in the BlobFrame
  std::vector<BlobTrackId> track;   ///< 2D track of the blob
  bool any_track = false;           ///< whether any blob of the frame has a 2D track
  /// By ray: the number of matches to which the ray is assigned. Not 0 past the last ray. Changed by `increment_use`
  /// and `decrement_use`.
  std::array<std::uint8_t, kMaxBlobs> use_count{};
  /// Single-precision copies: position and variance on the image plane at distance 1, and sigma_px.
  std::vector<float> x_f, y_f, variance_f, sigma_f;

  std::size_t size() const { return rays.x.size(); }
  double x(std::size_t ray) const { return rays.x[ray]; }
  double y(std::size_t ray) const { return rays.y[ray]; }
  /// The ray as an input of geometry::agree. Precondition: the quadric of the ray was made.
  geometry::QuadricSighting sighting(std::size_t ray, std::uint32_t source) const {
    return {&quadric[ray], &rows->depth, sigma_px[ray], source};
  }
  /// Makes the quadric of a ray if it was not made yet.
  void make_quadric(std::size_t ray) {
    if (has_quadric_[ray] == 0) write_quadric(ray);
  }
  /// Makes the quadrics of all rays with SIMD instructions.
  void make_all_quadrics();

  /// Assigns the ray to one more match, or releases it from one.
  void increment_use(std::size_t ray) { ++use_count[ray]; }
  void decrement_use(std::size_t ray) {
    if (--use_count[ray] == 0 && !listed_.has(ray)) listed_.add(ray, place(ray));
  }
  /// Sets the counts of all rays.
  void set_use_counts(std::span<const std::uint8_t> counts) {
    std::ranges::copy(counts.first(size()), use_count.begin());
  }
  /// The number of rays that belong to no match.
  std::size_t unassigned_count() const {
    return static_cast<std::size_t>(std::ranges::count(std::span(use_count).first(size()), std::uint8_t{0}));
  }
  /// Calls `visit` with each ray that belongs to no match, in order.
  template <class Visit>
  void for_each_unassigned(Visit&& visit) const {
    constexpr std::uint64_t kLow = 0x7F7F'7F7F'7F7F'7F7F;  // all bits of each byte except the highest
    for (std::size_t first = 0; first < size(); first += sizeof kLow) {
      std::uint64_t eight;
      std::memcpy(&eight, use_count.data() + first, sizeof eight);
      // The highest bit of each byte is set if the byte is 0.
      std::uint64_t zeros = ~(((eight & kLow) + kLow) | eight | kLow);
      for (; zeros != 0; zeros &= zeros - 1) visit(first + static_cast<std::size_t>(std::countr_zero(zeros)) / 8);
    }
  }

  /// The direction of the spread: a unit vector at twice the angle of the longer axis; zero if there is none.
  Eigen::Vector2d axis(std::size_t ray) const;
  /// The direction of the ray in the world; unit.
  Eigen::Vector3d direction(std::size_t ray) const;

  /// The distance in the image between a ray and the projection of a point, px at the focal length.
  double off_px(std::size_t ray, const WorldPoint& point) const;
  /// The projection of an uncertain point; nothing if the point is not in front of the camera.
  std::optional<ProjectedGaussian> projection(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2) const;
  /// The positions of all rays, their bounds, and the variance of a typical ray on the image plane at distance 1.
  RayPlaces places() const { return {x_f, y_f, variance_f}; }
  const RayBounds& bounds() const { return bounds_; }
  float typical_variance() const {
    // Gates are dimensioned for it; a less certain ray is listed in more bins. Chosen by hand; not yet measured.
    constexpr double kTypicalSigma_px = 0.5;
    return static_cast<float>(kTypicalSigma_px * kTypicalSigma_px / (focal_px * focal_px));
  }

  /// Lists the unassigned rays for a search within `sigmas`. A ray that is released later is added to the list.
  void list_unassigned(float sigmas);
  /// The listed rays; some of them may have been assigned since list_unassigned().
  const ListedRays& listed() const { return listed_; }

  double max_spread_px() const { return max_spread_px_; }
  /// Resets the counts and indices of all rays: no ray is assigned, no quadric is made.
  void index();

 private:
  friend class RayTable;
  void reserve();
  void drop_missing();
  void bound();
  void write_quadric(std::size_t ray);
  ListedRays::Place place(std::size_t ray) const { return {x_f[ray], y_f[ray], variance_f[ray]}; }

  double max_spread_px_ = 0.0;
  RayBounds bounds_;
  ListedRays listed_;
  std::vector<std::uint8_t> has_quadric_;
};

/// The rays of all blobs of one frame set. Each blob is undistorted once. Never allocates after construction.
class RayTable {
 public:
  /// `rig` must outlive the table.
  explicit RayTable(const Rig& rig);

  /// Begins a set. The frames must live until the next call. `cast` each view before its rays are used.
  void begin(const FrameSet& frames);
  /// Computes the rays of a view. A blob that is not finite, or that the lens model maps to no ray, has none.
  void cast(std::size_t view);

  std::size_t view_count() const { return view_count_; }
  ViewRays& operator[](std::size_t view) { return views_[view]; }
  const ViewRays& operator[](std::size_t view) const { return views_[view]; }

  /// Prepares the search for unassigned rays in all views, within at most `sigmas`.
  void list_unassigned(double sigmas);
  /// Projects a point into all views for `nearest_unassigned`. Precondition: `list_unassigned` was called with at least
  /// `sigmas`, the gate of the search. `floor_px`: standard deviation that is added to those of the point and the ray.
  void project_gaussian(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2, double sigmas,
                        double floor_px) {
    projector_.cast({point, covariance_m2, sigmas, floor_px}, view_count_);
  }
  /// The unassigned ray of a view that is nearest to the last projection, inside the gate.
  std::optional<std::size_t> nearest_unassigned(std::size_t view) const {
    return projector_.nearest_unassigned(view, views_[view]);
  }

  /// The view of a camera; nothing if the set has none.
  std::optional<std::size_t> view_of(std::size_t camera) const {
    if (view_of_[camera] == kNoView) return std::nullopt;
    return view_of_[camera];
  }

  /// Whether the point projects into the image of the view.
  bool is_in_image(std::size_t view, const WorldPoint& point) const;

 private:
  static constexpr std::uint32_t kNoView = 0xFFFF'FFFF;

  void cast_rays(const BlobFrame& frame, ViewRays& view);
  bool prepare_blobs(const BlobFrame& frame, ViewRays& view);
  void inflate_crowd_sigma(const BlobFrame& frame, ViewRays& view);

  const Rig& rig_;
  std::vector<geometry::RayCaster> casters_;  // by camera
  std::vector<geometry::CameraRows> rows_;    // by camera
  std::vector<double> max_ray_norm_;          // by camera: as max_ray_norm()
  std::vector<ViewRays> views_;
  std::vector<std::uint32_t> view_of_;  // by camera
  std::size_t view_count_ = 0;
  std::array<const BlobFrame*, kMaxCameras> frames_{};  // by view

  std::vector<double> u_px_, v_px_, areas_px2_;
  BatchProjector projector_;
};

}  // namespace mocap::associate
