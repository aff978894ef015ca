#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/log.h"
#include "base/time.h"
#include "model/detection_counts.h"
#include "runtime/pipeline.h"

namespace mocap::runtime {

/// What one camera's detector has told by some instant.
struct DetectionSeen {
  std::uint64_t images = 0;  ///< since the start, as the counts
  DetectionCounts counts;
  DetectionLevels levels;
};

DetectionSeen detection_seen(const Pipeline& pipeline, CameraId camera);

/// Turns what a camera's detector tells into what an operator should read in the log: its threshold when it is known
/// and when it has changed much, and why it finds no blobs. One thread, no hot one; `look` about once a second.
class DetectionReport {
 public:
  struct Line {
    LogLevel level;
    std::string what;
  };

  /// `automatic`: the threshold comes from the noise.
  explicit DetectionReport(bool automatic) : automatic_(automatic) {}

  /// The lines that are due at `now`; most calls give none.
  std::vector<Line> look(const DetectionSeen& seen, Timestamp now);

 private:
  std::optional<std::string> threshold_line(const DetectionLevels& levels, Timestamp now);
  std::optional<Line> losses_line(const DetectionSeen& seen, Timestamp now);

  bool automatic_;
  DetectionSeen before_;
  std::optional<double> told_threshold_grey_;
  Timestamp told_threshold_at_;
  std::optional<Timestamp> told_losses_at_;
  std::optional<Timestamp> blind_since_;
};

}  // namespace mocap::runtime
