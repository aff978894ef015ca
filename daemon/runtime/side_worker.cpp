#include "runtime/side_worker.h"

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr Duration kLongestSleep = std::chrono::milliseconds(50);

}  // namespace

SideWorker::SideWorker(std::vector<std::unique_ptr<Writer>> writers, bool lossless, SnapshotChannel& channel,
                       SideCounters& counters)
    : writers_(std::move(writers)), lossless_(lossless), channel_(channel), counters_(counters) {}

void SideWorker::run() {
  for (;;) {
    counters_.beats.add();
    const WakeSignal::Ticket ticket = channel_.there_is_work.ticket();
    const bool ended = channel_.ended.load(std::memory_order_acquire);
    bool any = learn_fits();
    while (const Snapshot* oldest = channel_.snapshots.front()) {
      write(*oldest);
      channel_.snapshots.pop();
      any = true;
      if (lossless_) channel_.room.signal();
    }
    if (any) continue;
    if (ended) {
      (void)learn_fits();
      break;
    }
    channel_.there_is_work.wait(ticket, kLongestSleep);
  }
  for (const std::unique_ptr<Writer>& writer : writers_) {
    const Status finished = writer->finish();
    if (!finished) log_error("record", finished.error().message);
  }
}

bool SideWorker::learn_fits() {
  SubjectFit fit;
  bool any = false;
  while (channel_.fits.try_pop(fit)) {
    any = true;
    for (const std::unique_ptr<Writer>& writer : writers_) {
      const Status learnt = writer->learn(fit);
      if (!learnt) log_error("record", learnt.error().message);
    }
  }
  return any;
}

void SideWorker::write(const Snapshot& snapshot) {
  for (const std::unique_ptr<Writer>& writer : writers_) {
    if (!writer->wants_snapshots()) continue;
    const Status written = writer->write(snapshot);
    if (written) {
      counters_.written.add();
    } else {
      counters_.failed.add();
      log_error("record", written.error().message);
    }
  }
}

}  // namespace mocap::runtime
