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

/// Where a camera would see an uncertain point: on the image plane at distance 1.
struct ProjectedGaussian {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// What one camera saw, as rays in the order of its blobs.
struct ViewRays {
  const CameraModel* camera = nullptr;
  const geometry::CameraRows* rows = nullptr;  ///< of the camera
  double focal_px = 1.0;
  geometry::RayColumns rays{kMaxBlobs};
  std::vector<geometry::RayQuadric> quadric;  ///< with sigma_px; of those rays only for which it was made
  std::vector<double> sigma_px;               ///< with the doubt that the blob's shape casts
  std::vector<double> spread_px;    ///< over 0: more than one marker is likely in the blob, so far from its centroid
  std::vector<double> axis_rad;     ///< where there is a spread: of the longer axis; NaN: not told
  std::vector<std::uint16_t> blob;  ///< index in the BlobFrame
  std::vector<BlobTrackId> track;   ///< the blob's
  bool any_track = false;           ///< whether any blob has one
  /// How many matches each ray belongs to; `increment_use` and `decrement_use` change it. More than none past the last
  /// ray.
  std::array<std::uint8_t, kMaxBlobs> use_count{};
  /// In single precision: place, variance on the image plane at distance 1, and sigma_px.
  std::vector<float> x_f, y_f, variance_f, sigma_f;

  std::size_t size() const { return rays.x.size(); }
  double x(std::size_t ray) const { return rays.x[ray]; }
  double y(std::size_t ray) const { return rays.y[ray]; }
  /// The ray's quadric has been made.
  geometry::QuadricSighting sighting(std::size_t ray, std::uint32_t source) const {
    return {&quadric[ray], &rows->depth, sigma_px[ray], source};
  }
  /// Makes a ray's quadric if it is not there.
  void make_quadric(std::size_t ray) {
    if (has_quadric_[ray] == 0) write_quadric(ray);
  }
  /// Makes those of all rays, many at a time.
  void make_all_quadrics();

  /// One match more has the ray, or one less.
  void increment_use(std::size_t ray) { ++use_count[ray]; }
  void decrement_use(std::size_t ray) {
    if (--use_count[ray] == 0 && !listed_.has(ray)) listed_.add(ray, place(ray));
  }
  /// As many matches have each ray as `holders` tells.
  void set_use_counts(std::span<const std::uint8_t> holders) {
    std::ranges::copy(holders.first(size()), use_count.begin());
  }
  /// How many rays no match has.
  std::size_t unassigned_count() const {
    return static_cast<std::size_t>(std::ranges::count(std::span(use_count).first(size()), std::uint8_t{0}));
  }
  /// Calls `visit` with each ray that no match has, in their order.
  template <class Visit>
  void for_each_unassigned(Visit&& visit) const {
    constexpr std::uint64_t kLow = 0x7F7F'7F7F'7F7F'7F7F;  // of each byte all bits but the highest
    for (std::size_t first = 0; first < size(); first += sizeof kLow) {
      std::uint64_t eight;
      std::memcpy(&eight, use_count.data() + first, sizeof eight);
      // The highest bit of each byte that is 0.
      std::uint64_t zeros = ~(((eight & kLow) + kLow) | eight | kLow);
      for (; zeros != 0; zeros &= zeros - 1) visit(first + static_cast<std::size_t>(std::countr_zero(zeros)) / 8);
    }
  }

  /// Where there is a spread: its direction, twice the angle of the longer axis as a unit vector; zero: not told.
  Eigen::Vector2d axis(std::size_t ray) const;
  /// Where the ray points to in the world; unit.
  Eigen::Vector3d direction(std::size_t ray) const;

  /// How far from a ray the camera would see the point.
  double off_px(std::size_t ray, const WorldPoint& point) const;
  /// Where the camera would see the point; nothing where it is not in front of it.
  std::optional<ProjectedGaussian> projection(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2) const;
  /// All rays' places, their bounds, and the variance over which a ray is less certain than most.
  RayPlaces places() const { return {x_f, y_f, variance_f}; }
  const RayBounds& bounds() const { return bounds_; }
  float typical_variance() const {
    constexpr double kTypicalSigma_px = 0.5;
    return static_cast<float>(kTypicalSigma_px * kTypicalSigma_px / (focal_px * focal_px));
  }

  /// Lists the rays that no match has, to look for near a place within so many `sigmas`; those that are given back
  /// later are listed then.
  void list_unassigned(float sigmas);
  /// Those listed; some of them may be taken since.
  const ListedRays& listed() const { return listed_; }

  double max_spread_px() const { return max_spread_px_; }
  /// Makes ready what is asked of all rays, when they are there: none is taken, none has a quadric.
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

/// The rays of all blobs of one frame set: undistorted once, then asked often. Never allocates after construction.
class RayTable {
 public:
  /// `rig` must outlive the table.
  explicit RayTable(const Rig& rig);

  /// Takes in a set, whose views must stay until the next; `cast` each of them before it is asked.
  void begin(const FrameSet& frames);
  /// The rays of a view's blobs. Blobs that no ray leads to, or whose numbers are not finite, are left out.
  void cast(std::size_t view);

  std::size_t view_count() const { return view_count_; }
  ViewRays& operator[](std::size_t view) { return views_[view]; }
  const ViewRays& operator[](std::size_t view) const { return views_[view]; }

  /// Makes ready what looks for rays that no match has, in all views, within so many `sigmas` at most.
  void list_unassigned(double sigmas);
  /// Casts the shadows of a point in all views, for `nearest_unassigned`; after `list_unassigned`. `sigmas`: how far a
  /// ray may be off; `floor_px`: standard deviation that is added to those of point and ray.
  void project_gaussian(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2, double sigmas,
                        double floor_px) {
    projector_.cast({point, covariance_m2, sigmas, floor_px}, view_count_);
  }
  /// The nearest ray of a view to the shadow that was cast last, in the gate, that is not taken.
  std::optional<std::size_t> nearest_unassigned(std::size_t view) const {
    return projector_.nearest_unassigned(view, views_[view]);
  }

  /// The view of a camera, or nothing when the set has none.
  std::optional<std::size_t> view_of(std::size_t camera) const {
    if (view_of_[camera] == kNoView) return std::nullopt;
    return view_of_[camera];
  }

  /// Whether the point lies in the image of this view's camera.
  bool is_in_image(std::size_t view, const WorldPoint& point) const;

 private:
  static constexpr std::uint32_t kNoView = 0xFFFF'FFFF;

  void cast_rays(const BlobFrame& frame, ViewRays& view);
  bool prepare_blobs(const BlobFrame& frame, ViewRays& view);
  void inflate_crowd_sigma(const BlobFrame& frame, ViewRays& view);

  const Rig& rig_;
  std::vector<geometry::RayCaster> casters_;  // by camera
  std::vector<geometry::CameraRows> rows_;    // by camera
  std::vector<double> max_ray_norm_;          // by camera: no pixel's ray lies farther from the axis
  std::vector<ViewRays> views_;
  std::vector<std::uint32_t> view_of_;  // by camera
  std::size_t view_count_ = 0;
  std::array<const BlobFrame*, kMaxCameras> frames_{};  // by view

  std::vector<double> u_px_, v_px_, areas_px2_;
  BatchProjector projector_;
};

}  // namespace mocap::associate
