#include "runtime/blob_recorder.h"

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr Duration kLongestSleep = std::chrono::milliseconds(50);

}  // namespace

BlobRecorder::BlobRecorder(std::unique_ptr<BlobWriter> writer, std::vector<CameraChannel*> cameras, WakeSignal& wake)
    : writer_(std::move(writer)), cameras_(std::move(cameras)), wake_(wake) {}

void BlobRecorder::run(const std::stop_token& stop) {
  for (;;) {
    const WakeSignal::Ticket ticket = wake_.ticket();
    const bool ended = stop.stop_requested();
    if (write_what_waits()) continue;
    if (ended) break;
    wake_.wait(ticket, kLongestSleep);
  }
  const Status finished = writer_->finish();
  if (!finished && !failed_) log_error("record", finished.error().message);
}

bool BlobRecorder::write_what_waits() {
  bool any = false;
  for (CameraChannel* channel : cameras_) {
    while (const BlobFrame* oldest = channel->to_record->front()) {
      any = true;
      const Status written = failed_ ? Status{} : writer_->write(*oldest);
      if (!written) {
        failed_ = true;
        log_error("record", written.error().message + "; the blob recording ends here, the feed goes on");
      }
      channel->to_record->pop();
      channel->record_room.signal();
    }
  }
  return any;
}

}  // namespace mocap::runtime
