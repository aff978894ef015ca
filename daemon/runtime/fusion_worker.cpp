#include "runtime/fusion_worker.h"

#include <algorithm>
#include <string_view>
#include <thread>

#include "base/log.h"

namespace mocap::runtime {
namespace {

// The longest sleep: the loop shows that it lives, and looks whether it is to stop.
constexpr Duration kLongestSleep = std::chrono::milliseconds(50);
constexpr Duration kTellTimingEvery = std::chrono::seconds(1);

}  // namespace

FusionWorker::FusionWorker(synchronise::AlignSettings align, std::unique_ptr<fusion::Fusion> fusion,
                           FusionWorkerSettings settings, Links links, FusionCounters& counters)
    : aligner_(align, links.cameras.size()),
      fusion_(std::move(fusion)),
      settings_(std::move(settings)),
      links_(std::move(links)),
      counters_(counters),
      delivery_(links_.cameras.size(), Delivery::NotYet) {
  // Live, a camera is waited for from its first frame on; in a replay from the start, so that the sets do not depend
  // on which camera's file was opened first.
  if (!settings_.lossless) {
    for (std::uint32_t i = 0; i < links_.cameras.size(); ++i) aligner_.finish(CameraId{i});
  }
}

void FusionWorker::run(const std::stop_token& stop) {
  const Status allowed = apply_to_this_thread(settings_.thread);
  if (!allowed) log_warn("fusion", allowed.error().message);
  while (!stop.stop_requested()) {
    counters_.beats.add();
    const WakeSignal::Ticket ticket = links_.wake->ticket();
    follow_orders();
    const bool gathered = gather();
    const bool fused = fuse_what_is_ready(stop);
    tell_timing();
    if (gathered || fused) continue;
    if (settings_.lossless && all_ended()) break;
    if (settings_.waiting == Waiting::Spin) continue;
    const Duration until_patience_ends = aligner_.patience_ends().value_or(Timestamp::max()) - host_now();
    links_.wake->wait(ticket, std::min(settings_.lossless ? kLongestSleep : until_patience_ends, kLongestSleep));
  }
  for (SnapshotChannel* channel : {links_.publish, links_.side}) {
    if (channel == nullptr) continue;
    channel->ended.store(true, std::memory_order_release);
    channel->there_is_work.signal();
  }
}

bool FusionWorker::gather() {
  bool any = false;
  for (std::size_t i = 0; i < links_.cameras.size(); ++i) {
    any = follow_delivery(i) || any;
    const CameraId id{static_cast<std::uint32_t>(i)};
    CameraChannel& channel = *links_.cameras[i];
    while (aligner_.has_room(id)) {
      const BlobFrame* frame = channel.frames.front();
      if (frame == nullptr) break;
      aligner_.add(*frame);
      channel.frames.pop();
      any = true;
      if (settings_.lossless) channel.room.signal();
    }
  }
  return any;
}

// Says whether the aligner learnt something new.
bool FusionWorker::follow_delivery(std::size_t camera) {
  CameraChannel& channel = *links_.cameras[camera];
  const Delivery now = channel.delivery.load(std::memory_order_acquire);
  if (now == delivery_[camera]) return false;
  // "Ended" speaks of frames that may still wait in the queue: it holds once they are taken.
  if (now == Delivery::Ended && channel.frames.front() != nullptr) return false;
  delivery_[camera] = now;
  const CameraId id{static_cast<std::uint32_t>(camera)};
  if (now == Delivery::Ended) {
    aligner_.finish(id);
  } else {
    aligner_.rejoin(id);
  }
  return true;
}

bool FusionWorker::fuse_what_is_ready(const std::stop_token& stop) {
  bool any = false;
  while (const std::optional<FrameSet> frames = aligner_.take(now())) {
    any = true;
    counters_.sets.add();
    if (frames->views.size() == links_.cameras.size()) counters_.complete_sets.add();
    const bool newer_waits = !settings_.every_set && !settings_.lossless && aligner_.ready(now());
    if (newer_waits) {
      counters_.passed_over_sets.add();
    } else {
      fuse(*frames, stop);
    }
  }
  return any;
}

void FusionWorker::fuse(const FrameSet& frames, const std::stop_token& stop) {
  Snapshot& snapshot = fusion_->step(frames);
  tell_rig();
  if (settings_.lossless) {
    snapshot.instants.received_at.reset();
    snapshot.instants.detected_at.reset();
  } else {
    snapshot.instants.fused_at = host_now();
  }
  if (fusion_->fit() && !links_.publish->fits.try_push(*fusion_->fit())) counters_.dropped_fits.add();
  if (fusion_->fit() && links_.side != nullptr && !links_.side->fits.try_push(*fusion_->fit())) {
    counters_.dropped_fits.add();
  }
  if (!hand_on(snapshot, *links_.publish, stop)) counters_.dropped_publish_full.add();
  if (links_.side != nullptr && !hand_on(snapshot, *links_.side, stop)) counters_.dropped_side_full.add();
}

bool FusionWorker::hand_on(const Snapshot& snapshot, SnapshotChannel& to, const std::stop_token& stop) {
  for (;;) {
    const WakeSignal::Ticket ticket = to.room.ticket();
    if (to.snapshots.try_push(snapshot)) break;
    if (!settings_.lossless || stop.stop_requested()) return false;
    counters_.beats.add();
    to.room.wait(ticket, kLongestSleep);
  }
  to.there_is_work.signal();
  return true;
}

// What an operator asks.
void FusionWorker::follow_orders() {
  if (links_.control == nullptr) return;
  SubjectOrder order;
  while (links_.control->to_fusion.try_pop(order)) {
    std::string_view words;
    switch (order.action) {
      case SubjectAction::Add:
        fusion_->set_away(order.subject, false);
        words = "is looked for";
        break;
      case SubjectAction::Remove:
        fusion_->set_away(order.subject, true);
        words = "is away";
        break;
      case SubjectAction::Reset:
        fusion_->reset(order.subject);
        words = "forgotten; the next T-pose or A-pose tells where it is and how it measures";
        break;
      case SubjectAction::Fit:
        fusion_->refit(order.fit);
        words = "measures as told from the next set on";
        break;
    }
    OrderDone done;
    done.order = order.number;
    done.done = true;
    for (const char c : words) done.message.push_back(c);
    static_cast<void>(links_.control->from_fusion.try_push(done));
  }
}

void FusionWorker::tell_rig() {
  const drift::CameraDrift* drift = fusion_->drift();
  if (drift == nullptr || fusion_->assessed().value >= links_.cameras.size()) return;
  RigGauges& rig = links_.cameras[fusion_->assessed().value]->rig;
  rig.off_px.set(drift->off_px);
  rig.turned_rad.set(drift->turned_rad);
  rig.moved_m.set(drift->moved_m);
  rig.drifted.set(drift->drifted ? 1.0 : 0.0);
}

// To the publish thread, which tells the operator.
void FusionWorker::tell_timing() {
  if (settings_.lossless || host_now() - timing_told_at_ < kTellTimingEvery) return;
  timing_told_at_ = host_now();
  aligner_.assess_timing();
  for (std::uint32_t i = 0; i < links_.cameras.size(); ++i) {
    static_cast<void>(links_.cameras[i]->timings.try_push(aligner_.timing(CameraId{i})));
  }
}

bool FusionWorker::all_ended() const {
  return std::all_of(delivery_.begin(), delivery_.end(), [](Delivery d) { return d == Delivery::Ended; });
}

Timestamp FusionWorker::now() const { return settings_.lossless ? Timestamp::min() : host_now(); }

}  // namespace mocap::runtime
