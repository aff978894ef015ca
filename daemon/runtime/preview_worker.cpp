#include "runtime/preview_worker.h"

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr Duration kIdlePeriod = std::chrono::milliseconds(500);

}  // namespace

void PreviewWorker::run(const std::stop_token& stop) {
  const std::stop_callback wake(stop, [this] { channel_.there_is_work.signal(); });
  while (!stop.stop_requested()) {
    const WakeSignal::Ticket ticket = channel_.there_is_work.ticket();
    if (!encode_waiting()) channel_.there_is_work.wait(ticket, kIdlePeriod);
  }
}

bool PreviewWorker::encode_waiting() {
  bool any = false;
  for (CameraChannel* camera : cameras_) {
    const PreviewImage* image = camera->preview.waiting();
    if (image == nullptr) continue;
    any = true;
    preview_.head = image->head;
    const auto jpeg = encoder_->encode(*image);
    camera->preview.release();
    if (!jpeg) {
      log_warn("preview", jpeg.error().message);
      continue;
    }
    preview_.jpeg.assign(jpeg->begin(), jpeg->end());
    static_cast<void>(channel_.previews.try_push(preview_));
  }
  return any;
}

}  // namespace mocap::runtime
