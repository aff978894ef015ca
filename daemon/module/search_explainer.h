#pragma once

#include <cstdint>
#include <span>

#include "model/detection_counts.h"
#include "model/search_health.h"
#include "model/search_report.h"

namespace mocap {

/// The counts of one camera since the last report.
struct CameraSight {
  std::uint64_t images = 0;
  DetectionCounts detection;  ///< of these images
  DetectionLevels levels;     ///< of the newest image
};

/// Finds the reason why a subject is not found. Not for the hot path: it allocates, and takes some ten milliseconds.
///
/// One thread makes all calls.
class SearchExplainer {
 public:
  virtual ~SearchExplainer() = default;

  /// `cameras`: by CameraId, one for each camera of the rig. The cause is None if nothing hinders the search.
  virtual SearchHealth explain(const SearchReport& report, std::span<const CameraSight> cameras) = 0;
};

}  // namespace mocap
