#include "runtime/blob_recorder.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {}  // namespace

BlobRecorder::BlobRecorder(std::unique_ptr<BlobWriter> writer, std::vector<CameraChannel*> cameras, WakeSignal& wake)
    : writer_(std::move(writer)), cameras_(std::move(cameras)), wake_(wake), progress_(writer_->path()) {}

void BlobRecorder::run(const std::stop_token& stop) {
  for (;;) {
    const WakeSignal::Ticket ticket = wake_.ticket();
    const bool ended = stop.stop_requested();
    if (write_waiting()) continue;
    if (ended) break;
    wake_.wait(ticket, kStopCheckPeriod);
  }
  if (pausing()) return;
  if (progress_.state() == RecordingState::Failed) return;
  const Status finished = writer_->finish();
  progress_.finished(finished, writer_->size());
}

bool BlobRecorder::write_waiting() {
  bool any = false;
  for (CameraChannel* channel : cameras_) {
    while (const BlobFrame* oldest = channel->to_record->front()) {
      any = true;
      if (progress_.state() != RecordingState::Failed) {
        const Status written = writer_->write(*oldest);
        progress_.wrote(written, writer_->size());
      }
      channel->to_record->pop();
      channel->record_room.signal();
    }
  }
  return any;
}

}  // namespace mocap::runtime
