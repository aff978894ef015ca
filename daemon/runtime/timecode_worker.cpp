#include "runtime/timecode_worker.h"

#include <fmt/format.h>

#include <utility>

#include "base/log.h"
#include "model/search_health.h"

namespace mocap::runtime {
namespace {

constexpr const char* kTimecode = "timecode";
constexpr Duration kPatience = std::chrono::milliseconds(50);
// A source that has just started has no signal yet; the first lock takes 0.3 s.
constexpr Duration kStartsWithin = std::chrono::seconds(2);

}  // namespace

TimecodeWorker::TimecodeWorker(std::unique_ptr<TimecodeSource> source, TimecodeChannel& channel)
    : source_(std::move(source)), channel_(channel) {}

void TimecodeWorker::run(const std::stop_token& stop) {
  const Timestamp begun = host_now();
  while (!stop.stop_requested()) {
    source_->listen(kPatience);
    const Timestamp now = host_now();
    const TimecodeHealth state = source_->state(now);
    static_cast<void>(channel_.to_fusion.try_push(state.clock));
    static_cast<void>(channel_.to_publish.try_push(state));
    static_cast<void>(channel_.to_takes.try_push(state));
    if (state.state != TimecodeState::Searching || now - begun > kStartsWithin) report(state);
  }
}

void TimecodeWorker::report(const TimecodeHealth& state) {
  if (state.state == reported_) return;
  reported_ = state.state;
  const std::string why(text_of(state.sentence));
  if (state.state != TimecodeState::Locked) return log_warn(kTimecode, why);
  const auto now = state.clock ? timecode_at(*state.clock, host_now()) : std::nullopt;
  log_info(kTimecode,
           fmt::format("locked to {}, now {}, {:.3f} frames/s", state.source == TimecodeSourceKind::Utc ? "UTC" : "LTC",
                       now ? text_of(*now) : "unknown", state.clock ? state.clock->frames_per_s : 0.0));
}

}  // namespace mocap::runtime
