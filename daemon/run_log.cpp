#include "run_log.h"

#include <fmt/format.h>

#include <numbers>

#include "base/log.h"

namespace mocap {

RunLog::RunLog(const settings::DaemonSettings& settings) : drifted_(settings.cameras.size(), false) {
  for (std::uint32_t i = 0; i < settings.cameras.size(); ++i) {
    const bool automatic = !settings::detect_of(settings, CameraId{i}).threshold.has_value();
    names_.push_back("camera " + settings.cameras[i].name);
    detection_.emplace_back(automatic);
  }
}

void RunLog::write(const runtime::Pipeline& pipeline, Timestamp now) {
  for (std::uint32_t i = 0; i < names_.size(); ++i) {
    for (const auto& line : detection_[i].look(runtime::detection_seen(pipeline, CameraId{i}), now)) {
      line.level == LogLevel::Warn ? log_warn(names_[i], line.what) : log_info(names_[i], line.what);
    }
  }
  write_drift(pipeline);
}

void RunLog::write_drift(const runtime::Pipeline& pipeline) {
  for (std::uint32_t i = 0; i < names_.size(); ++i) {
    const runtime::RigGauges& rig = pipeline.rig_gauges(CameraId{i});
    const bool drifted = rig.drifted.read() > 0.0;
    if (drifted == drifted_[i]) continue;
    drifted_[i] = drifted;
    if (!drifted) {
      log_info(names_[i], "agrees with the rig again");
      continue;
    }
    log_warn(names_[i], fmt::format("differs from the rig: off={:.1f}px, rotated by {:.2f}deg and moved by {:.0f}mm; "
                                    "check whether it was bumped (mocap-calibrate verify), and correct the rig with "
                                    "mocap-calibrate refine",
                                    rig.off_px.read(), rig.turned_rad.read() * 180.0 / std::numbers::pi,
                                    1e3 * rig.moved_m.read()));
  }
}

}  // namespace mocap
