#pragma once

#include <cstdint>
#include <span>

#include "base/bounded_vector.h"
#include "filter/isotropic_kalman.h"
#include "geometry/disc_shapes.h"
#include "model/blob.h"

namespace mocap::track2d {

/// Two markers in one image whose blobs are ambiguous: their discs overlap, or one blob could belong to either.
///
/// Each hypothesis assigns the blobs of all images so far to the two markers and has a filter for each marker. Its cost
/// is -2 ln of its likelihood, summed over all innovations. Two blobs are the markers in either order. One blob is both
/// markers merged (its area and elongation give their distance, not their order), or one of them while the other is
/// hidden. So motion decides whether two markers turned back, passed or crossed while they shared a blob. Hypotheses
/// with nearly equal states are merged, and the least costly are kept.
///
/// Source: Reid, "An algorithm for tracking multiple targets", IEEE Trans. Automatic Control 24 (1979), section III,
/// for a cluster of two targets.
class BlobPair {
 public:
  struct Member {
    std::uint32_t track = 0;
    double area_px2 = 0.0;  ///< of the marker's own, unmerged blob
  };
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  BlobPair(const filter::IsotropicKalman<2>& first, const filter::IsotropicKalman<2>& second, const Member& one,
           const Member& other);

  void predict(double dt_s);

  /// Updates the hypotheses with no blob, one blob or two blobs, given by their indices in the image.
  void see_none();
  void see_one(const Blob& blob, std::uint32_t index, const geometry::TwoDiscs& discs);
  void see_two(std::span<const Blob* const, 2> blobs, std::span<const std::uint32_t, 2> indices);

  /// Whether the last image showed two separate blobs.
  bool is_separate() const { return images_separate_ > 0; }
  std::uint32_t images_separate() const { return images_separate_; }
  /// Whether the best hypothesis has both markers in one blob.
  bool is_merged() const { return best().blob[0] != kNone && best().blob[0] == best().blob[1]; }
  /// Cost difference between the best hypothesis and the best one with another assignment of the last blobs.
  double runner_up_margin() const { return runner_up_margin_; }

  const Member& member(std::size_t i) const { return members_[i]; }
  Member& member(std::size_t i) { return members_[i]; }
  /// The member's blob in the best hypothesis (index, or kNone), and its filter.
  std::uint32_t blob(std::size_t i) const { return best().blob[i]; }
  const filter::IsotropicKalman<2>& filter(std::size_t i) const { return best().filter[i]; }

 private:
  struct Hypothesis {
    filter::IsotropicKalman<2> filter[2];
    std::uint32_t blob[2];
    double cost;
  };
  struct Sighting {
    filter::Vector<2> point_px;
    double variance_px2;
    std::uint32_t blob;
  };
  static constexpr std::size_t kMaxHypotheses = 8;

  const Hypothesis& best() const { return hypotheses_[0]; }
  using Hypotheses = BoundedVector<Hypothesis, 4 * kMaxHypotheses>;

  static void add(const Hypothesis& from, const Sighting* first, const Sighting* second, double cost, Hypotheses& to);
  void prune_hypotheses(const Hypotheses& next);
  bool same(const filter::IsotropicKalman<2>& a, const filter::IsotropicKalman<2>& b) const;

  Member members_[2];
  BoundedVector<Hypothesis, kMaxHypotheses> hypotheses_;  // by ascending cost
  double dt_s_ = 0.0;                                     // time step of the last prediction
  double runner_up_margin_ = 0.0;
  std::uint32_t images_separate_ = 0;
};

/// Position of a marker that is partly occluded.
struct OccludedDisc {
  filter::Vector<2> centre_px;
  double sigma_px;  ///< standard deviation, each axis
};

/// Estimates the centre of a partly occluded marker from a blob that is smaller than `whole_area_px2`. If the blob's
/// elongation agrees with a disc that a straight edge cuts to the blob's area, the centre is corrected across the cut,
/// towards `expected_px`. Otherwise the direction is unknown: the blob's centroid is returned with the covariance of
/// that uncertainty.
OccludedDisc estimate_occluded_disc(const Blob& blob, double whole_area_px2, const filter::Vector<2>& expected_px,
                                    const geometry::CutDisc& cut);

}  // namespace mocap::track2d
