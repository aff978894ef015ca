#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calibration/diagnosis/camera_views.h"
#include "model/points.h"

namespace mocap::calibration {

/// A point where rays of two cameras meet, and the blobs of other cameras at its projection.
struct RayMeeting {
  struct View {
    std::size_t camera = 0;
    std::size_t blob = 0;
  };
  WorldPoint point;         ///< triangulated from the first two views
  std::vector<View> views;  ///< two or more, of different cameras
};

/// The meetings at each instant.
using RayMeetings = std::vector<std::vector<RayMeeting>>;

/// All meetings of the rays of each camera with those of its kNeighbours next cameras, at each instant. Most meetings
/// of only two rays are accidental.
RayMeetings find_meetings(const std::vector<CameraViews>& cameras);

/// A point that cameras agree on.
struct ConsensusPoint {
  WorldPoint point;
  bool is_confirmed = false;  ///< three cameras or more agree; false: two
};

/// Whether points of two cameras replace those of three, if hardly any three cameras agree. With at most four cameras
/// to choose from, both kinds are always used.
enum class Fallback { None, Pairs };

/// The points at each instant that the cameras except `excluded` agree on: those of three cameras or more, each blob in
/// at most one of them; and, with at most four such cameras or as a fallback, all meetings of two other blobs. A point
/// that stays in one place occurs at most kMaxRepetitions times, because its views are not independent.
std::vector<std::vector<ConsensusPoint>> consensus_points(const RayMeetings& meetings,
                                                          const std::vector<CameraViews>& cameras, std::size_t excluded,
                                                          Fallback fallback);

}  // namespace mocap::calibration
