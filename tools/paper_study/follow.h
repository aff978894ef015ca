#pragma once

#include <span>
#include <vector>

#include "module/blob_tracker.h"
#include "paper_study/clip.h"
#include "paper_study/see.h"

namespace mocap::paper_study {

/// One frame of a clip as a tracker lived through it.
struct FollowedFrame {
  Eigen::Vector2d predicted_px = Eigen::Vector2d::Zero();  ///< for this frame, before it was seen
  double gate_radius_px = 0.0;                             ///< 0: the track has ended
  Eigen::Vector2d label_px = Eigen::Vector2d::Zero();      ///< where the label stands after it
  bool held = false;                                       ///< the label took a blob
  bool named = false;                                      ///< and the frame says so
};

/// How a tracker fared in one clip: all frames but the first, in which the label is given.
struct Followed {
  std::vector<FollowedFrame> frames;
  std::vector<double> errors_px;  ///< of the predictions, by frame
  bool lost = false;
};

/// Runs a tracker, new and with BlobTrackInspection, through a clip.
///
/// The label is given in the first frame to the track of the labelled marker's blob, confirmed or not: from then on it
/// is that track, and nothing gives it back once the track has ended. The first frame shows the labelled marker alone,
/// as the operator's click did. An error is the distance of the prediction from the truth; where the track has ended,
/// its last prediction stays.
Followed follow(BlobTracker& tracker, const Clip& clip, std::span<const Seen> sightings);

}  // namespace mocap::paper_study
