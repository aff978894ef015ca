#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/diagnosis/camera_views.h"
#include "model/points.h"

namespace mocap::calibration {

/// A point where rays of two cameras meet, and the blobs of other cameras at its projection.
struct RayIntersection {
  struct View {
    std::size_t camera = 0;
    std::size_t blob = 0;
  };
  WorldPoint point;         ///< triangulated from the first two views
  std::vector<View> views;  ///< two or more, of different cameras
};

/// The intersections at each instant.
using RayIntersections = std::vector<std::vector<RayIntersection>>;

/// All intersections of the rays of each camera with those of its kNeighbours next cameras, at each instant. Most
/// intersections of only two rays are accidental.
RayIntersections find_intersections(const std::vector<CameraViews>& cameras);

/// A point that cameras agree on.
struct ConsensusPoint {
  WorldPoint point;
  bool is_confirmed = false;  ///< three cameras or more agree; false: two
};

/// Whether points of two cameras replace those of three, if hardly any three cameras agree. With at most four cameras
/// to choose from, both kinds are always used.
enum class Fallback { None, Pairs };

/// The points at each instant that the cameras except `excluded` agree on: those of three cameras or more, each blob in
/// at most one of them; and, with at most four such cameras or as a fallback, all intersections of two other blobs. A
/// point that stays in one place occurs at most kMaxRepetitions times, because its views are not independent.
std::vector<std::vector<ConsensusPoint>> consensus_points(const RayIntersections& intersections,
                                                          const std::vector<CameraViews>& cameras, std::size_t excluded,
                                                          Fallback fallback);

}  // namespace mocap::calibration
