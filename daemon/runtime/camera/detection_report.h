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

/// State of one camera's detector at one instant.
struct DetectionSeen {
  std::uint64_t images = 0;  ///< since the start of the daemon, as `counts`
  DetectionCounts counts;
  DetectionLevels levels;
};

DetectionSeen detection_seen(const Pipeline& pipeline, CameraId camera);

/// Derives log lines from the state of a camera's detector: its threshold when first known and after a large change,
/// and the reason why the detector finds no blobs. Allocates: the main thread owns it and calls `look` about once a
/// second.
class DetectionReport {
 public:
  struct Line {
    LogLevel level;
    std::string what;
  };

  /// `automatic`: the threshold is computed from the image noise.
  explicit DetectionReport(bool automatic) : automatic_(automatic) {}

  /// Returns the lines that are due at `now`; usually none.
  std::vector<Line> look(const DetectionSeen& seen, Timestamp now);

 private:
  std::optional<std::string> threshold_line(const DetectionLevels& levels, Timestamp now);
  std::optional<Line> losses_line(const DetectionSeen& seen, Timestamp now);

  bool automatic_;
  DetectionSeen before_;
  std::optional<double> logged_threshold_grey_;
  Timestamp logged_threshold_at_;
  std::optional<Timestamp> logged_losses_at_;
  std::optional<Timestamp> blind_since_;
};

}  // namespace mocap::runtime
