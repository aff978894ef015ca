#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "associate/multi_view_matcher.h"
#include "associate/rays/view_rays.h"
#include "associate/rig_error.h"
#include "associate/unassigned/camera_pair_schedule.h"
#include "base/bounded_vector.h"
#include "geometry/ray_quadric.h"

namespace mocap::associate {

/// The second half of matching: finds markers that nobody expected, among the rays that are not taken. Never allocates
/// after construction.
///
/// Pairs of cameras are asked in rounds, in each of which a camera has one partner, the best suited first. A pair's
/// rays near each other's epipolar lines give a hypothesis, which the other views support or not. What nearly all
/// cameras support is believed at the end of the round, so that later rounds have little left; the rest is decided
/// when all rounds are through.
class NewMatcher {
 public:
  /// All three must outlive it; `error` tells how far off a view of one marker may be.
  NewMatcher(const MatchSettings& settings, const Rig& rig, RigError& error);

  /// Appends the markers found and takes their rays. `missing_views`: cameras whose view the set lacks; any of them
  /// might have seen a marker.
  void match(RayTable& rays, std::uint32_t missing_views, Matches& into);

 private:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;  // no hypothesis
  // A ray of a view.
  struct Member {
    std::uint16_t view;
    std::uint16_t ray;
  };
  struct Hypothesis {
    geometry::Refined at;
    std::uint32_t could_see = 0;  // cameras in whose image the point lies, those without a view included
    bool strong = false;          // nobody need ask about its rays for now
    BoundedVector<Member, kMaxCameras> members;
  };
  using Sightings = BoundedVector<geometry::QuadricSighting, kMaxCameras>;
  // The rays of a view that are not taken, by column.
  struct FreeRays {
    std::size_t count = 0;
    std::vector<std::uint16_t> ray = std::vector<std::uint16_t>(kMaxBlobs);
    std::vector<float> x = std::vector<float>(kMaxBlobs), y = x, sigma_px = x;
    // In the world, 1 m along the camera's axis.
    std::vector<Eigen::Vector3d> direction = std::vector<Eigen::Vector3d>(kMaxBlobs);
    Eigen::Vector3d eye;
    double focal_px = 1.0;

    std::span<const std::uint16_t> rays() const { return std::span(ray).first(count); }
  };
  struct NearLine {
    float off;
    std::uint32_t index;  // in the free rays
  };

  void gather_free(const RayTable& rays);
  void ask_pair(RayTable& rays, const CameraPair& pair);
  void find_nearest_to_lines(const FreeRays& of_a, const FreeRays& of_b, const CameraPair& pair);
  double allowed_px(double sigma_px) const;
  void ask_ray(RayTable& rays, const CameraPair& pair, std::size_t a, std::size_t i, std::size_t b);
  void measure_line(const FreeRays& of_b, const Eigen::Vector3d& line);
  void find_near_line(const FreeRays& of_b, const Eigen::Vector3d& line, double allowed);
  void ask_again(RayTable& rays, Matches& into);
  void ask_round(RayTable& rays, std::size_t round);
  void propose(RayTable& rays, std::size_t a, std::size_t i, std::size_t b, std::size_t j);
  bool is_explained(Member a, Member b) const;
  bool put_off(Member member);
  bool start(RayTable& rays, std::size_t a, std::size_t i, std::size_t b, std::size_t j);
  void gather_support(RayTable& rays, Hypothesis& from);
  bool settle(RayTable& rays, Hypothesis& hypothesis);
  void count_cameras(const RayTable& rays, Hypothesis& hypothesis) const;
  std::uint32_t needed(const Hypothesis& hypothesis) const;
  void remember(const Hypothesis& hypothesis);
  void forget(std::uint32_t index);
  void decide(RayTable& rays, bool last_round, Matches& into);
  bool lose_taken(RayTable& rays, Hypothesis& hypothesis);
  void believe(RayTable& rays, const Hypothesis& hypothesis, Matches& into);
  void believe_lone_pairs(RayTable& rays, Matches& into);
  bool is_better(std::size_t a, std::size_t b) const;
  static std::size_t slot(Member member) { return member.view * kMaxBlobs + member.ray; }

  const MatchSettings& settings_;
  RigError& error_;
  double rig_px_ = 0.0;  // of this set
  geometry::Agreement agreement_;
  PairRounds rounds_;
  double max_cos_angle_;
  std::size_t next_round_ = 0;  // of those that are not asked in every set
  std::uint32_t missing_views_ = 0;
  std::size_t work_ = 0;
  std::uint32_t skipped_ = 0;

  std::vector<Hypothesis> hypotheses_;
  std::vector<std::uint32_t> open_;  // a heap of hypotheses that wait for their decision
  std::vector<std::uint32_t> undecided_;
  std::vector<std::uint32_t> best_of_;  // of view * kMaxBlobs + ray: the best hypothesis that it is a member of
  std::vector<std::uint32_t> rivals_;   // likewise: how many two-view hypotheses want it
  std::vector<std::uint8_t> put_off_;   // likewise: whether a question about it was put off
  std::vector<FreeRays> free_;          // by view
  std::size_t free_views_ = 0;          // that have any
  bool asking_again_ = false;           // only about rays that were put off
  std::vector<float> off_;
  // Of a pair of cameras, by the first one's free rays: their lines, and how much farther off than allowed the nearest
  // ray of the other is.
  std::array<std::vector<float>, 3> lines_;
  std::vector<float> beyond_;
  std::vector<NearLine> near_line_;
  Hypothesis trial_;
  Sightings sightings_;
  // A copy costs what is in it; one made from nothing is cleared as a whole, with the room for all cameras.
  const Match none_{};
};

}  // namespace mocap::associate
