#include "runtime/explain_worker.h"

#include <utility>

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr Duration kExplainPeriod = std::chrono::milliseconds(500);
// Period of the counts of the cameras; reports of several subjects within it share them.
constexpr Duration kLookPeriod = std::chrono::milliseconds(500);

}  // namespace

ExplainWorker::ExplainWorker(std::unique_ptr<SearchExplainer> explainer, std::vector<std::string> subjects,
                             std::vector<CameraChannel*> cameras, SearchChannel& search)
    : explainer_(std::move(explainer)),
      subjects_(std::move(subjects)),
      cameras_(std::move(cameras)),
      search_(search),
      seen_(cameras_.size()),
      sights_(cameras_.size()),
      logged_(subjects_.size(), SearchCause::None) {}

void ExplainWorker::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const WakeSignal::Ticket ticket = search_.there_is_work.ticket();
    const SearchReport* report = search_.reports.front();
    if (report == nullptr) {
      search_.there_is_work.wait(ticket, kExplainPeriod);
      continue;
    }
    explain(*report);
    search_.reports.pop();
  }
}

void ExplainWorker::explain(const SearchReport& report) {
  if (report.subject.value >= subjects_.size()) return;
  look_at_cameras();
  const SearchHealth reason = explainer_->explain(report, sights_);
  static_cast<void>(search_.reasons.try_push(reason));
  SearchCause& logged = logged_[report.subject.value];
  if (reason.cause == logged) return;
  logged = reason.cause;
  if (!reason.sentence.empty()) {
    log_info("subject " + subjects_[report.subject.value], std::string(text_of(reason.sentence)));
  }
}

void ExplainWorker::look_at_cameras() {
  const Timestamp now = host_now();
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const CameraCounters& counters = cameras_[i]->counters;
    Seen& seen = seen_[i];
    if (seen.frames > 0 && now - seen.at < kLookPeriod) continue;
    const Seen fresh{counters.frames.read(), counters.detection.counts(), now};
    sights_[i] = {fresh.frames - seen.frames, fresh.detection.since(seen.detection), counters.detection.levels()};
    seen = fresh;
  }
}

}  // namespace mocap::runtime
