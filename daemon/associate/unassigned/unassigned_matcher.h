#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "associate/match_settings.h"
#include "associate/rays/view_rays.h"
#include "associate/rig_error.h"
#include "associate/unassigned/camera_pair_schedule.h"
#include "base/archive.h"
#include "base/bounded_vector.h"
#include "geometry/ray_quadric.h"

namespace mocap::associate {

/// The second half of matching: finds markers without a prediction among the unassigned rays. Never allocates after
/// construction.
///
/// Camera pairs are processed in rounds (CameraPairSchedule). Two rays near each other's epipolar lines (Hartley and
/// Zisserman 2004, chapter 9) form a hypothesis, which is triangulated and supported by the nearest rays of the other
/// views. A hypothesis with nearly all cameras is accepted at the end of its round, which leaves fewer rays for later
/// rounds; the others are accepted after the last round, most views first, then least error.
class UnassignedMatcher {
 public:
  /// `settings`, `rig` and `error` must outlive this object.
  UnassignedMatcher(const MatchSettings& settings, const Rig& rig, RigError& error);

  /// Appends a match for each marker found and assigns its rays. `missing_views`: number of cameras without a view in
  /// the set; any of them might have seen a marker.
  void match(RayTable& rays, std::uint32_t missing_views, Matches& into);

  void archive(Archive& members);

 private:
  static constexpr std::uint32_t kNone = 0xFFFF'FFFF;  // no hypothesis
  struct HypothesisRay {
    std::uint16_t view;
    std::uint16_t ray;
  };
  struct Hypothesis {
    geometry::Refined at;
    std::uint32_t observing_cameras = 0;  // cameras that could see the point, including those without a view
    bool is_well_supported = false;       // its rays are paired again only if they remain unassigned
    BoundedVector<HypothesisRay, kMaxCameras> members;
  };
  using Sightings = BoundedVector<geometry::QuadricSighting, kMaxCameras>;
  // The unassigned rays of a view, as columns.
  struct UnassignedRays {
    std::size_t count = 0;
    std::vector<std::uint16_t> ray = std::vector<std::uint16_t>(kMaxBlobs);
    std::vector<float> x = std::vector<float>(kMaxBlobs), y = x, sigma_px = x;
    // In the world, at depth 1 m.
    std::vector<Eigen::Vector3d> direction = std::vector<Eigen::Vector3d>(kMaxBlobs);
    Eigen::Vector3d eye;
    double focal_px = 1.0;

    std::span<const std::uint16_t> rays() const { return std::span(ray).first(count); }
  };
  struct LineCandidate {
    float distance;
    std::uint32_t index;  // index in UnassignedRays
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
  void store(const Hypothesis& hypothesis);
  void discard(std::uint32_t index);
  void accept_hypotheses(RayTable& rays, bool last_round, Matches& into);
  bool remove_used_rays(RayTable& rays, Hypothesis& hypothesis);
  void accept(RayTable& rays, const Hypothesis& hypothesis, Matches& into);
  void accept_isolated_pairs(RayTable& rays, Matches& into);
  bool may_be_candidate(const RayTable& rays, const Hypothesis& hypothesis) const;
  void append_candidates(const RayTable& rays, Matches& into);
  void append_candidate(const RayTable& rays, const Hypothesis& hypothesis, Matches& into) const;
  bool is_better(std::size_t a, std::size_t b) const;
  static std::size_t slot(HypothesisRay member) { return member.view * kMaxBlobs + member.ray; }

  const MatchSettings& settings_;
  RigError& error_;
  double rig_px_ = 0.0;  // rig error in this set
  geometry::Agreement agreement_;
  CameraPairSchedule rounds_;
  double max_cos_angle_;
  std::size_t next_round_ = 0;  // the next of the rounds that are not processed in every set
  std::uint32_t missing_views_ = 0;
  std::uint32_t required_views_ = 2;  // views of a match (decisions/0016)
  std::size_t work_ = 0;
  std::uint32_t skipped_ = 0;

  std::vector<Hypothesis> hypotheses_;
  std::vector<std::uint32_t> decision_queue_;  // heap of hypotheses, the best first
  std::vector<std::uint32_t> undecided_;
  std::vector<Hypothesis> candidates_;           // have too few views for a match
  std::vector<std::uint32_t> best_of_;           // at view * kMaxBlobs + ray: the best hypothesis with this ray
  std::vector<std::uint32_t> competitor_count_;  // likewise: number of two-view hypotheses with this ray
  std::vector<std::uint8_t> deferred_;           // likewise: whether a pairing was deferred
  std::vector<UnassignedRays> unassigned_;       // by view
  std::size_t views_with_unassigned_ = 0;        // number of views with unassigned rays
  bool retrying_ = false;                        // only deferred rays are paired
  std::vector<float> distance_;
  // For a camera pair, by unassigned ray of a: its epipolar line in b, and the result of measure_line_excess().
  std::array<std::vector<float>, 3> epipolar_lines_;
  std::vector<float> line_excess_;
  std::vector<LineCandidate> line_candidates_;
  Hypothesis trial_;
  Sightings sightings_;
  // Copying an empty match is cheaper than value-initialising a match with capacity for all cameras.
  const Match none_{};
};

}  // namespace mocap::associate
