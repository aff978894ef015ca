#include "runtime/status_line.h"

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
                   fusion.dropped_side_full.read() + publish.passed_over.read();
  for (std::uint32_t i = 0; i < pipeline.camera_count(); ++i) {
    const CameraCounters& camera = pipeline.camera_counters(CameraId{i});
    totals.frames.push_back(camera.frames.read());
    totals.dropped += camera.dropped_queue_full.read();
  }
  return totals;
}

std::string status_line(const RunTotals& before, const RunTotals& now, Duration span) {
  std::size_t delivering = 0;
  for (std::size_t i = 0; i < now.frames.size(); ++i) {
    if (i >= before.frames.size() || now.frames[i] > before.frames[i]) ++delivering;
  }
  const double s = to_s(span);
  const auto sets = static_cast<double>(now.sets - before.sets);
  const auto complete = static_cast<double>(now.complete_sets - before.complete_sets);
  const auto sent = static_cast<double>(now.sent - before.sent);
  return fmt::format("cameras={} of {} sets={:.1f}/s complete={:.1f}% sent={:.1f}/s dropped={}", delivering,
                     now.frames.size(), sets / s, sets > 0.0 ? 100.0 * complete / sets : 0.0, sent / s, now.dropped);
}

std::string summary_line(const RunTotals& totals) {
  return fmt::format("sets={} complete={} sent={} dropped={}", totals.sets, totals.complete_sets, totals.sent,
                     totals.dropped);
}

}  // namespace mocap::runtime
