#include "runtime/side_worker.h"

#include <utility>

#include "base/log.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

void log_failed(const Status& done) {
  if (!done) log_error("record", done.error().message);
}

}  // namespace

SideFile::SideFile(std::unique_ptr<Writer> writer) : writer_(std::move(writer)), progress_(writer_->path()) {}

void SideFile::describe(const Description& description) { log_failed(writer_->describe(description)); }

void SideFile::learn(const SubjectFit& fit) { log_failed(writer_->learn(fit)); }

void SideFile::write(const Snapshot& snapshot, SideCounters& counters) {
  if (!is_recording() || progress_.state() == RecordingState::Failed) return;
  const Status written = writer_->write(snapshot);
  progress_.wrote(written, writer_->size());
  (written ? counters.written : counters.failed).add();
}

void SideFile::finish() {
  if (progress_.state() == RecordingState::Failed) return;
  const Status finished = writer_->finish();
  if (is_recording()) {
    progress_.finished(finished, writer_->size());
  } else {
    log_failed(finished);
  }
}

SideWorker::SideWorker(std::vector<std::unique_ptr<Writer>> writers, bool lossless, SnapshotChannel& channel,
                       SideCounters& counters)
    : lossless_(lossless), channel_(&channel), counters_(counters) {
  for (std::unique_ptr<Writer>& writer : writers) files_.push_back(std::make_unique<SideFile>(std::move(writer)));
}

std::vector<const RecordingProgress*> SideWorker::recordings() const {
  std::vector<const RecordingProgress*> borrowed;
  for (const auto& file : files_) {
    if (file->is_recording()) borrowed.push_back(&file->progress());
  }
  return borrowed;
}

std::vector<std::unique_ptr<SideFile>> SideWorker::change(Change change) {
  std::vector<std::unique_ptr<SideFile>> ended;
  std::vector<std::unique_ptr<SideFile>> now;
  for (std::unique_ptr<SideFile>& file : files_) {
    const bool continues = file->is_recording() && change.recordings_continue;
    (continues ? now : ended).push_back(std::move(file));
  }
  for (std::unique_ptr<Writer>& writer : change.writers) now.push_back(std::make_unique<SideFile>(std::move(writer)));
  files_ = std::move(now);
  for (const auto& file : files_) file->describe(*change.description);
  channel_ = change.channel;
  return ended;
}

void SideWorker::run() {
  for (;;) {
    counters_.beats.add();
    const WakeSignal::Ticket ticket = channel_->there_is_work.ticket();
    const bool ended = channel_->ended.load(std::memory_order_acquire);
    bool any = learn_fits();
    while (const Snapshot* oldest = channel_->snapshots.front()) {
      (void)learn_fits();  // a fit is pushed before the first snapshot that uses it
      for (const auto& file : files_) file->write(*oldest, counters_);
      channel_->snapshots.pop();
      any = true;
      if (lossless_) channel_->room.signal();
    }
    if (any) continue;
    if (ended) break;
    if (pausing()) return;
    channel_->there_is_work.wait(ticket, kStopCheckPeriod);
  }
  (void)learn_fits();
  for (const auto& file : files_) file->finish();
}

bool SideWorker::learn_fits() {
  SubjectFit fit;
  bool any = false;
  while (channel_->fits.try_pop(fit)) {
    any = true;
    for (const auto& file : files_) file->learn(fit);
  }
  return any;
}

}  // namespace mocap::runtime
