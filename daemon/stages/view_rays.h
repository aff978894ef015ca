#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "geometry/ray_caster.h"
#include "geometry/ray_quadric.h"
#include "model/camera_model.h"
#include "model/ids.h"
#include "model/sighting.h"
#include "stages/view_shadows.h"

namespace mocap::stages {

/// Where a camera would see an uncertain point: on the image plane at distance 1.
struct Shadow {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

/// What one camera saw, as rays in the order of its blobs.
struct ViewRays {
  const CameraModel* camera = nullptr;
  const geometry::CameraRows* rows = nullptr;  ///< of the camera
  double focal_px = 1.0;
  geometry::RayColumns rays{kMaxBlobs};
  std::vector<RayQuadric> quadric;  ///< with sigma_px; of those rays only for which it was made
  std::vector<double> sigma_px;     ///< with the doubt that the blob's shape casts
  std::vector<double> spread_px;    ///< over 0: more than one marker is likely in the blob, so far from its centroid
  std::vector<double> axis_rad;     ///< where there is a spread: of the longer axis; NaN: not told
  std::vector<std::uint16_t> blob;  ///< index in the BlobFrame
  std::vector<BlobTrackId> track;   ///< the blob's
  bool any_track = false;           ///< whether any blob has one
  std::vector<std::uint8_t> taken;  ///< how many matches it belongs to; `take` and `give_back` change it
  /// In single precision: place, and variance on the image plane at distance 1.
  std::vector<float> x_f, y_f, variance_f;

  std::size_t size() const { return rays.x.size(); }
  double x(std::size_t ray) const { return rays.x[ray]; }
  double y(std::size_t ray) const { return rays.y[ray]; }
  /// The ray's quadric has been made.
  geometry::QuadricSighting sighting(std::size_t ray, std::uint32_t source) const {
    return {&quadric[ray], &rows->depth, sigma_px[ray], 1.0, source};
  }
  bool has_quadric(std::size_t ray) const { return has_quadric_[ray] != 0; }
  /// Makes a ray's quadric if it is not there.
  void make_quadric(std::size_t ray);
  /// Makes those of all rays that no match has.
  void make_free_quadrics();

  /// One match more has the ray, or one less.
  void take(std::size_t ray) {
    ++taken[ray];
    free_[ray / 64] &= ~(std::uint64_t{1} << (ray % 64));
  }
  /// One match more has each of the rays that `ray_of` tells of 0 to `count`; 0xFFFFFFFF: none.
  template <class RayOf>
  void take_all(std::size_t count, RayOf&& ray_of) {
    std::array<std::uint64_t, kWords> gone{};
    std::uint64_t gone_first = 0;  // of the first word: what is in a register is at hand at once
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t ray = ray_of(i);
      if (ray == 0xFFFF'FFFF) continue;
      ++taken[ray];
      const std::uint64_t bit = std::uint64_t{1} << (ray % 64);
      if (ray < 64) {
        gone_first |= bit;
      } else {
        gone[ray / 64] |= bit;
      }
    }
    gone[0] = gone_first;
    for (std::size_t word = 0; word < words_; ++word) free_[word] &= ~gone[word];
  }
  void give_back(std::size_t ray) {
    if (--taken[ray] == 0) free_[ray / 64] |= std::uint64_t{1} << (ray % 64);
  }
  /// How many rays no match has.
  std::size_t free_count() const {
    std::size_t count = 0;
    for (std::size_t word = 0; word < words_; ++word) count += static_cast<std::size_t>(std::popcount(free_[word]));
    return count;
  }
  /// Calls `visit` with each ray that no match has, in their order.
  template <class Visit>
  void for_free(Visit&& visit) const {
    for (std::size_t word = 0; word < words_; ++word) visit_bits(word, free_[word], visit);
  }

  /// Where there is a spread: its direction, twice the angle of the longer axis as a unit vector; zero: not told.
  Eigen::Vector2d axis(std::size_t ray) const;
  /// Where the ray points to in the world; unit.
  Eigen::Vector3d direction(std::size_t ray) const;

  /// How far from a ray the camera would see the point.
  double off_px(std::size_t ray, const WorldPoint& point) const;
  /// Where the camera would see the point; nothing where it is not in front of it.
  std::optional<Shadow> shadow(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2) const;
  /// Squared distance of a ray from a shadow in standard deviations of both, `floor_px` added to them.
  double distance2(const Shadow& shadow, std::size_t ray, double floor_px) const;
  /// What the least certain ray and `floor_px` add to the variance of a shadow.
  double most_own(double floor_px) const {
    return (max_sigma_px_ * max_sigma_px_ + floor_px * floor_px) / (focal_px * focal_px);
  }
  /// Calls `visit` with each ray that is at most `half_x` and `half_y` off a place, and a few others near it.
  template <class Visit>
  void near(double at_x, double at_y, double half_x, double half_y, Visit&& visit) const {
    constexpr double kRounding = 0.01;  // of a bin: rays are put into bins in single precision
    const std::size_t left = bin_of((at_x - half_x - min_x_) * bins_per_x_ - kRounding);
    const std::size_t right = bin_of((at_x + half_x - min_x_) * bins_per_x_ + (1.0 + kRounding));
    const std::size_t top = bin_of((at_y - half_y - min_y_) * bins_per_y_ - kRounding);
    const std::size_t bottom = bin_of((at_y + half_y - min_y_) * bins_per_y_ + (1.0 + kRounding));
    in_bins({left, right, top, bottom}, visit);
  }
  /// Where a place's bounds lie among the columns and rows of bins: the first that counts, and the first that does not.
  struct Bins {
    std::size_t left, right, top, bottom;
  };
  /// As `near`, by bins.
  template <class Visit>
  void in_bins(const Bins& bins, Visit&& visit) const {
    const std::size_t end = end_word_[bins.bottom];
    for (std::size_t word = first_word_[bins.top]; word < end; ++word)
      visit_bits(word, in_bins_word(bins, word), visit);
  }
  /// The rays of the only word, of a view of at most 64.
  bool has_one_word() const { return words_ == 1; }
  std::uint64_t only_word_in_bins(const Bins& bins) const {
    return before_x_[bins.right] & ~before_x_[bins.left] & before_y_[bins.bottom] & ~before_y_[bins.top];
  }
  /// The same by words: calls `visit` with a word's number and its bits, one for each ray from 64 times the number on.
  template <class Visit>
  void words_in_bins(const Bins& bins, Visit&& visit) const {
    const std::size_t end = end_word_[bins.bottom];
    for (std::size_t word = first_word_[bins.top]; word < end; ++word) visit(word, in_bins_word(bins, word));
  }
  /// As `in_bins`, those only that no match has.
  template <class Visit>
  void free_in_bins(const Bins& bins, Visit&& visit) const {
    const std::size_t end = end_word_[bins.bottom];
    for (std::size_t word = first_word_[bins.top]; word < end; ++word) {
      visit_bits(word, in_bins_word(bins, word) & free_[word], visit);
    }
  }
  /// x lies in bin (x - min_x) * per_x, from 0 to `bins`.
  struct BinScale {
    double min_x, min_y, per_x, per_y, bins;
  };
  BinScale bin_scale() const { return {min_x_, min_y_, bins_per_x_, bins_per_y_, static_cast<double>(bins_)}; }

  double max_spread_px() const { return max_spread_px_; }
  double max_sigma_px() const { return max_sigma_px_; }
  /// Makes ready all that looks for rays near a place, when all rays are there.
  void index();

 private:
  friend class RayTable;
  static constexpr std::size_t kMostBins = 128;
  static constexpr std::size_t kWords = kMaxBlobs / 64;

  // Those left of the right end and not left of the left one; likewise in y.
  std::uint64_t in_bins_word(const Bins& bins, std::size_t word) const {
    return before_x_[bins.right * words_ + word] & ~before_x_[bins.left * words_ + word] &
           before_y_[bins.bottom * words_ + word] & ~before_y_[bins.top * words_ + word];
  }
  template <class Visit>
  static void visit_bits(std::size_t word, std::uint64_t bits, Visit&& visit) {
    for (; bits != 0; bits &= bits - 1) visit(64 * word + static_cast<std::size_t>(std::countr_zero(bits)));
  }
  void reserve();
  void drop_missing();
  void bound();
  void find_bins();
  void fill_bins();
  void bound_words();

  // Bins 0 to bins_: what is out of bounds on either side, or no number, goes to an end.
  std::size_t bin_of(double at) const {
    const double low = at > 0.0 ? at : 0.0;
    const double most = static_cast<double>(bins_);
    return static_cast<std::size_t>(low < most ? low : most);
  }

  double max_sigma_px_ = 0.0;
  double max_spread_px_ = 0.0;
  // The image's rays lie in bins_ columns and rows; which rays lie before each of them.
  std::size_t bins_ = 0;
  std::size_t words_ = 0;
  double min_x_ = 0.0;
  double min_y_ = 0.0;
  double bins_per_x_ = 0.0;
  double bins_per_y_ = 0.0;
  std::array<std::uint64_t, (kMostBins + 1) * kWords> before_x_{};  // of bin * words_ + word, a bit a ray
  std::array<std::uint64_t, (kMostBins + 1) * kWords> before_y_{};
  // Rays come about in the order of y: those of the bins from b on begin in the word first_word_[b], those of the bins
  // before b end before the word end_word_[b].
  std::array<std::uint8_t, kMostBins + 1> first_word_{};
  std::array<std::uint8_t, kMostBins + 1> end_word_{};
  std::array<std::uint64_t, kWords> free_{};
  std::vector<std::uint8_t> has_quadric_;
  std::vector<std::int32_t> column_, row_;  // the bin after the one that each ray lies in
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

  /// Casts the shadows of a point in all views, for `nearest_free`. `sigmas`: how far a ray may be off; `floor_px`:
  /// standard deviation that is added to those of point and ray.
  void cast_shadows(const Eigen::Vector3d& point, const Eigen::Matrix3d& covariance_m2, double sigmas,
                    double floor_px) {
    shadows_.cast({point, covariance_m2, sigmas, floor_px}, view_count_);
  }
  /// The nearest ray of a view to the shadow that was cast last, in the gate, that is not taken.
  std::optional<std::size_t> nearest_free(std::size_t view) const { return shadows_.nearest_free(view, views_[view]); }

  /// The view of a camera, or nothing when the set has none.
  std::optional<std::size_t> view_of(std::size_t camera) const;

  /// Whether the point lies in the image of this view's camera.
  bool could_see(std::size_t view, const WorldPoint& point) const;

 private:
  void cast_view(const BlobFrame& frame, ViewRays& view);
  bool read_blobs(const BlobFrame& frame, ViewRays& view);
  void doubt_crowds(const BlobFrame& frame, ViewRays& view);

  const Rig& rig_;
  std::vector<geometry::RayCaster> casters_;  // by camera
  std::vector<geometry::CameraRows> rows_;    // by camera
  std::vector<double> reach_;                 // by camera: no pixel's ray lies farther from the axis
  std::vector<ViewRays> views_;
  std::vector<std::uint32_t> view_of_;  // by camera
  std::size_t view_count_ = 0;
  std::array<const BlobFrame*, kMaxCameras> frames_{};  // by view

  std::vector<double> u_px_, v_px_, areas_px2_;
  ViewShadows shadows_;
};

}  // namespace mocap::stages
