#include "web/takes/exports.h"

#include <algorithm>
#include <utility>

namespace mocap::web {
namespace {

bool has_ended(const ExportJob& job) { return job.state == ExportState::Done || job.state == ExportState::Failed; }

}  // namespace

std::shared_ptr<ExportJob> Exports::wish(const std::string& key, const ExportWish& wish) {
  if (auto known = find(key)) return known;
  if (!make_room()) return nullptr;
  auto job = std::make_shared<ExportJob>();
  job->key = key;
  const bool queued = worker_.run([this, job, wish] {
    run_here_([job] { job->state = ExportState::Running; });
    auto file = runner_(wish, job->progress, stopped_);
    run_here_([this, job, file = std::move(file)]() mutable { end(*job, std::move(file)); });
  });
  if (!queued) return nullptr;
  jobs_.push_back(job);
  return job;
}

std::shared_ptr<ExportJob> Exports::find(const std::string& key) {
  const auto found = std::ranges::find(jobs_, key, [](const auto& job) { return job->key; });
  if (found == jobs_.end()) return nullptr;
  auto job = *found;
  if (job->state == ExportState::Failed) jobs_.erase(found);
  return job;
}

// Forgets the oldest export that has ended, if there are too many.
bool Exports::make_room() {
  if (jobs_.size() < kMaxExports) return true;
  const auto ended = std::ranges::find_if(jobs_, [](const auto& job) { return has_ended(*job); });
  if (ended == jobs_.end()) return false;
  jobs_.erase(ended);
  return true;
}

void Exports::end(ExportJob& job, Result<std::shared_ptr<OpenFile>> file) {
  if (file) {
    job.state = ExportState::Done;
    job.file = *std::move(file);
  } else {
    job.state = ExportState::Failed;
    job.fault = file.error().message;
  }
  for (const auto& tell : std::exchange(job.waiting, {})) tell(job);
}

}  // namespace mocap::web
