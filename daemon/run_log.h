#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/time.h"
#include "runtime/camera/detection_report.h"
#include "runtime/pipeline.h"
#include "settings/daemon_settings.h"

namespace mocap {

/// The log of what changes in a running configuration: thresholds and blobs of each camera, and whether its pose agrees
/// with the rig. Main thread.
class RunLog {
 public:
  explicit RunLog(const settings::DaemonSettings& settings);

  /// Logs the changes since the last call. Call once a second.
  void write(const runtime::Pipeline& pipeline, Timestamp now);
  /// The same for the poses alone.
  void write_drift(const runtime::Pipeline& pipeline);

 private:
  std::vector<std::string> names_;  // "camera NAME", by CameraId
  std::vector<runtime::DetectionReport> detection_;
  std::vector<bool> drifted_;
};

}  // namespace mocap
