#pragma once

#include <cstdint>
#include <span>

#include "base/bounded_vector.h"
#include "filter/isotropic_kalman.h"
#include "geometry/disc_shapes.h"
#include "model/blob.h"

namespace mocap::track2d {

/// Two markers of one image that cannot be told apart for a while: their discs overlap, or both could be one blob.
///
/// Each hypothesis is a story of which marker was which part of what was seen, with a filter for each marker; its cost
/// is -2 ln of the stories' likelihood, the sum over all innovations. Two blobs are the markers in either order. One
/// blob is both, where its area and elongation tell how far apart they are, but not which is which; or it is one of
/// them, and the other is hidden. So the sides of two markers that turn back, pass or cross behind each other are
/// followed by their motion through the time that they are one blob. Near equal stories are one, the cheapest stay.
///
/// Source: Reid, "An algorithm for tracking multiple targets", IEEE Trans. Automatic Control 24 (1979), section III,
/// for a cluster of two targets.
class BlobPair {
 public:
  struct Member {
    std::uint32_t track = 0;
    double area_px2 = 0.0;  ///< of its blob while it is alone
  };
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;

  BlobPair(const filter::IsotropicKalman<2>& first, const filter::IsotropicKalman<2>& second, const Member& one,
           const Member& other);

  void predict(double dt_s);

  /// Takes in what was seen: no blob, one, or two, by their indices in the image.
  void see_none();
  void see_one(const Blob& blob, std::uint32_t index, const geometry::TwoDiscs& discs);
  void see_two(std::span<const Blob* const, 2> blobs, std::span<const std::uint32_t, 2> indices);

  /// Whether the last image showed both, each in a blob of its own.
  bool is_separate() const { return images_separate_ > 0; }
  std::uint32_t images_separate() const { return images_separate_; }
  /// Whether the best story has both in one blob.
  bool is_merged() const { return best().blob[0] != kNone && best().blob[0] == best().blob[1]; }
  /// By how much the best story is cheaper than the best one that gives the blobs otherwise.
  double runner_up_margin() const { return runner_up_margin_; }

  const Member& member(std::size_t i) const { return members_[i]; }
  Member& member(std::size_t i) { return members_[i]; }
  /// Of the best story: index of the member's blob, or kNone; and its filter.
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
  BoundedVector<Hypothesis, kMaxHypotheses> hypotheses_;  // the cheapest first
  double dt_s_ = 0.0;                                     // the last step
  double runner_up_margin_ = 0.0;
  std::uint32_t images_separate_ = 0;
};

/// Where a marker is, of which a blob shows a part.
struct OccludedDisc {
  filter::Vector<2> centre_px;
  double sigma_px;  ///< standard deviation, each axis
};

/// Reads a blob that is smaller than its marker's, `whole_area_px2`: a straight edge has cut it where its elongation
/// agrees with its area; the centre lies across the cut, on the side of `expected_px`. Otherwise the centre may be on
/// any side, and the blob's own middle stands for it, as uncertain as that makes it.
OccludedDisc estimate_occluded_disc(const Blob& blob, double whole_area_px2, const filter::Vector<2>& expected_px,
                                    const geometry::CutDisc& cut);

}  // namespace mocap::track2d
