#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "module/blob_tracker.h"
#include "paper_study/clip.h"
#include "paper_study/see.h"

namespace mocap::paper_study {

/// State of a tracker in one frame of a clip.
struct FollowedFrame {
  Eigen::Vector2d predicted_px = Eigen::Vector2d::Zero();  ///< prediction for this frame, before its blobs
  double gate_radius_px = 0.0;                             ///< 0 after the end of the track
  Eigen::Vector2d label_px = Eigen::Vector2d::Zero();      ///< position of the label after this frame
  bool held = false;                                       ///< a blob was assigned to the label
  bool named = false;                                      ///< and that blob has the label's track id in the output
};

/// Result of a tracker in one clip: all frames except the first, in which the label is assigned.
struct Followed {
  std::vector<FollowedFrame> frames;
  std::vector<double> errors_px;  ///< prediction errors, by frame
  bool lost = false;
};

/// Runs a new tracker that implements BlobTrackInspection on a clip.
/// In the first frame, which shows only the labelled marker (the study's operator clicked on it), the label is assigned
/// to the track of the marker's blob, confirmed or not. The label stays with this track and is lost when the track
/// ends. An error is the distance of the prediction from the truth. After the end of the track the last prediction is
/// used.
Followed follow(BlobTracker& tracker, const Clip& clip, std::span<const Seen> sightings);

}  // namespace mocap::paper_study
