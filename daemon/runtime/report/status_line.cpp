#include "runtime/report/status_line.h"

#include <fmt/format.h>

namespace mocap::runtime {

RunTotals totals_of(const Pipeline& pipeline) {
  const FusionCounters& fusion = pipeline.fusion_counters();
  const PublishCounters& publish = pipeline.publish_counters();
  RunTotals totals;
  totals.sets = fusion.sets.read();
  totals.complete_sets = fusion.complete_sets.read();
  totals.sent = publish.sent.read();
  totals.dropped = fusion.passed_over_sets.read() + fusion.dropped_publish_full.read() +
                   fusion.dropped_side_full.read() + fusion.dropped_take_full.read() + publish.passed_over.read();
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    const CameraCounters& camera = pipeline.camera_counters(CameraId{i});
    totals.frames.push_back(camera.frames.read());
    totals.dropped +=
        camera.dropped_queue_full.read() + camera.dropped_record_full.read() + camera.dropped_take_full.read();
    totals.cameras.push_back(pipeline.camera_name(CameraId{i}));
    totals.blob_use.push_back(pipeline.blob_use(CameraId{i}));
  }
  for (const RecordingProgress* recording : pipeline.recordings()) {
    if (recording->state() == RecordingState::Failed) totals.failed_recordings.push_back(recording->path());
  }
  return totals;
}

namespace {

std::string idle_cameras(const RunTotals& before, const RunTotals& now) {
  if (before.blob_use.size() != now.blob_use.size()) return {};
  std::vector<BlobUse> use;
  for (std::size_t i = 0; i < now.blob_use.size(); ++i) use.push_back(now.blob_use[i].since(before.blob_use[i]));
  std::string text;
  for (std::size_t i = 0; i < use.size(); ++i) {
    const std::string why = why_no_markers(use, i);
    if (!why.empty()) text += fmt::format(" camera '{}': {}; {}", now.cameras[i], why, kNoMarkersRemedy);
  }
  return text;
}

}  // namespace

std::string status_line(const RunTotals& before, const RunTotals& now, Duration span) {
  std::size_t delivering = 0;
  for (std::size_t i = 0; i < now.frames.size(); ++i) {
    if (i >= before.frames.size() || now.frames[i] > before.frames[i]) ++delivering;
  }
  const double s = to_s(span);
  const auto sets = static_cast<double>(now.sets - before.sets);
  const auto complete = static_cast<double>(now.complete_sets - before.complete_sets);
  const auto sent = static_cast<double>(now.sent - before.sent);
  std::string line =
      fmt::format("cameras={} of {} sets={:.1f}/s complete={:.1f}% sent={:.1f}/s dropped={}", delivering,
                  now.frames.size(), sets / s, sets > 0.0 ? 100.0 * complete / sets : 0.0, sent / s, now.dropped);
  for (const std::string& path : now.failed_recordings) line += fmt::format(" recording '{}' failed", path);
  return line + idle_cameras(before, now);
}

std::string summary_line(const RunTotals& totals) {
  return fmt::format("sets={} complete={} sent={} dropped={}", totals.sets, totals.complete_sets, totals.sent,
                     totals.dropped);
}

}  // namespace mocap::runtime
