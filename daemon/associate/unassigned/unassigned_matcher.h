#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "associate/match_settings.h"
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
class UnassignedMatcher {
 public:
  /// All three must outlive it; `error` tells how far off a view of one marker may be.
  UnassignedMatcher(const MatchSettings& settings, const Rig& rig, RigError& error);

  /// Appends the markers found and takes their rays. `missing_views`: cameras whose view the set lacks; any of them
  /// might have seen a marker.
  void match(RayTable& rays, std::uint32_t missing_views, Matches& into);

 private:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;  // no hypothesis
  // A ray of a view.
  struct HypothesisRay {
    std::uint16_t view;
    std::uint16_t ray;
  };
  struct Hypothesis {
    geometry::Refined at;
    std::uint32_t observing_cameras = 0;  // cameras in whose image the point lies, those without a view included
    bool is_well_supported = false;       // nobody need ask about its rays for now
    BoundedVector<HypothesisRay, kMaxCameras> members;
  };
  using Sightings = BoundedVector<geometry::QuadricSighting, kMaxCameras>;
  // The rays of a view that are not taken, by column.
  struct UnassignedRays {
    std::size_t count = 0;
    std::vector<std::uint16_t> ray = std::vector<std::uint16_t>(kMaxBlobs);
    std::vector<float> x = std::vector<float>(kMaxBlobs), y = x, sigma_px = x;
    // In the world, 1 m along the camera's axis.
    std::vector<Eigen::Vector3d> direction = std::vector<Eigen::Vector3d>(kMaxBlobs);
    Eigen::Vector3d eye;
    double focal_px = 1.0;

    std::span<const std::uint16_t> rays() const { return std::span(ray).first(count); }
  };
  struct LineCandidate {
    float distance;
    std::uint32_t index;  // in the free rays
  };

  void gather_unassigned(const RayTable& rays);
  void match_pair(RayTable& rays, const CameraPair& pair);
  void measure_line_excess(const UnassignedRays& of_a, const UnassignedRays& of_b, const CameraPair& pair);
  double epipolar_gate_px(double sigma_px) const;
  void match_ray(RayTable& rays, const CameraPair& pair, std::size_t a, std::size_t i, std::size_t b);
  void measure_line_distances(const UnassignedRays& of_b, const Eigen::Vector3d& line);
  void find_line_candidates(const UnassignedRays& of_b, const Eigen::Vector3d& line, double allowed);
  void retry_deferred(RayTable& rays, Matches& into);
  void match_round(RayTable& rays, std::size_t round);
  void try_pair(RayTable& rays, std::size_t a, std::size_t i, std::size_t b, std::size_t j);
  bool is_explained(HypothesisRay a, HypothesisRay b) const;
  bool defer(HypothesisRay member);
  bool triangulate_pair(RayTable& rays, std::size_t a, std::size_t i, std::size_t b, std::size_t j);
  void gather_support(RayTable& rays, Hypothesis& from);
  bool refine(RayTable& rays, Hypothesis& hypothesis);
  void count_observing_cameras(const RayTable& rays, Hypothesis& hypothesis) const;
  std::uint32_t required_views(const Hypothesis& hypothesis) const;
  void store(const Hypothesis& hypothesis);
  void discard(std::uint32_t index);
  void accept_hypotheses(RayTable& rays, bool last_round, Matches& into);
  bool remove_taken(RayTable& rays, Hypothesis& hypothesis);
  void accept(RayTable& rays, const Hypothesis& hypothesis, Matches& into);
  void accept_isolated_pairs(RayTable& rays, Matches& into);
  bool is_better(std::size_t a, std::size_t b) const;
  static std::size_t slot(HypothesisRay member) { return member.view * kMaxBlobs + member.ray; }

  const MatchSettings& settings_;
  RigError& error_;
  double rig_px_ = 0.0;  // of this set
  geometry::Agreement agreement_;
  CameraPairSchedule rounds_;
  double max_cos_angle_;
  std::size_t next_round_ = 0;  // of those that are not asked in every set
  std::uint32_t missing_views_ = 0;
  std::size_t work_ = 0;
  std::uint32_t skipped_ = 0;

  std::vector<Hypothesis> hypotheses_;
  std::vector<std::uint32_t> decision_queue_;  // a heap of hypotheses that wait for their decision
  std::vector<std::uint32_t> undecided_;
  std::vector<std::uint32_t> best_of_;  // of view * kMaxBlobs + ray: the best hypothesis that it is a member of
  std::vector<std::uint32_t> competitor_count_;  // likewise: how many two-view hypotheses want it
  std::vector<std::uint8_t> deferred_;           // likewise: whether a question about it was put off
  std::vector<UnassignedRays> unassigned_;       // by view
  std::size_t views_with_unassigned_ = 0;        // that have any
  bool retrying_ = false;                        // only about rays that were put off
  std::vector<float> distance_;
  // Of a pair of cameras, by the first one's free rays: their lines, and how much farther off than allowed the nearest
  // ray of the other is.
  std::array<std::vector<float>, 3> epipolar_lines_;
  std::vector<float> line_excess_;
  std::vector<LineCandidate> line_candidates_;
  Hypothesis trial_;
  Sightings sightings_;
  // A copy costs what is in it; one made from nothing is cleared as a whole, with the room for all cameras.
  const Match none_{};
};

}  // namespace mocap::associate
