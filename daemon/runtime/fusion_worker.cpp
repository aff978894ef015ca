#include "runtime/fusion_worker.h"

#include <algorithm>
#include <string_view>
#include <thread>
#include <utility>

#include "base/archive.h"
#include "base/log.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

// Longest sleep of the loop, so that it counts its iterations for the watchdog and notices a stop request.
constexpr Duration kTimingPeriod = std::chrono::seconds(1);

}  // namespace

FusionWorker::FusionWorker(synchronise::AlignSettings align, std::unique_ptr<fusion::Fusion> fusion,
                           FusionWorkerSettings settings, Links links, FusionCounters& counters)
    : align_(align),
      aligner_(align, links.cameras.size()),
      fusion_(std::move(fusion)),
      settings_(std::move(settings)),
      links_(std::move(links)),
      counters_(counters),
      delivery_(links_.cameras.size(), Delivery::NotYet) {
  expect_delivering_cameras();
}

// In a live run the aligner waits for a camera from its first frame on. In a replay it waits for each camera from the
// start, so that the sets do not depend on the order in which the cameras' files are opened.
void FusionWorker::expect_delivering_cameras() {
  if (settings_.lossless) return;
  for (std::uint32_t i = 0; i < links_.cameras.size(); ++i) {
    if (delivery_[i] == Delivery::NotYet) aligner_.finish(CameraId{i});
  }
}

void FusionWorker::change(Change change) {
  change.fusion->adopt(*fusion_, change.handover);
  fusion_ = std::move(change.fusion);
  settings_ = std::move(change.settings);
  if (change.links.timecode == nullptr) timecode_.reset();
  const std::vector<CameraChannel*> before = std::exchange(links_, std::move(change.links)).cameras;
  if (before.size() != links_.cameras.size() || !(change.align == align_)) {
    synchronise::FrameAligner aligner(change.align, links_.cameras.size());
    aligner.continue_after(aligner_);
    aligner_ = std::move(aligner);
    align_ = change.align;
    delivery_.assign(links_.cameras.size(), Delivery::NotYet);
  }
  for (std::size_t i = 0; i < delivery_.size(); ++i) {
    if (i >= before.size() || before[i] != links_.cameras[i]) delivery_[i] = Delivery::NotYet;
  }
  expect_delivering_cameras();
}

void FusionWorker::run(const std::stop_token& stop) {
  const Status allowed = apply_to_this_thread(settings_.thread);
  if (!allowed) log_warn("fusion", allowed.error().message);
  while (!stop.stop_requested()) {
    counters_.beats.add();
    const WakeSignal::Ticket ticket = links_.wake->ticket();
    follow_orders();
    follow_timecode();
    const bool gathered = gather();
    const bool fused = fuse_ready_sets(stop);
    send_timing();
    if (gathered || fused) continue;
    if (settings_.lossless && all_ended()) break;
    if (settings_.waiting == Waiting::Spin) continue;
    const Duration until_patience_ends = aligner_.patience_ends().value_or(Timestamp::max()) - host_now();
    links_.wake->wait(ticket, std::min(settings_.lossless ? kStopCheckPeriod : until_patience_ends, kStopCheckPeriod));
  }
  if (pausing()) return follow_orders();  // the ids in the orders are those of this configuration
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

// Passes a change of the camera's delivery to the aligner. Returns whether there was a change.
bool FusionWorker::follow_delivery(std::size_t camera) {
  CameraChannel& channel = *links_.cameras[camera];
  const Delivery now = channel.delivery.load(std::memory_order_acquire);
  if (now == delivery_[camera]) return false;
  // The camera has ended for the aligner only when the frames before its end have left the queue.
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

bool FusionWorker::fuse_ready_sets(const std::stop_token& stop) {
  bool any = false;
  while (const std::optional<FrameSet> frames = aligner_.take(now())) {
    any = true;
    counters_.sets.add();
    if (frames->views.size() == links_.cameras.size()) counters_.complete_sets.add();
    const bool only_newest = !settings_.every_set && !settings_.lossless;
    if (only_newest && aligner_.is_superseded(*frames, now())) {
      counters_.passed_over_sets.add();
    } else {
      fuse(*frames, stop);
    }
  }
  return any;
}

void FusionWorker::fuse(const FrameSet& frames, const std::stop_token& stop) {
  Snapshot& snapshot = fusion_->step(frames);
  update_rig_gauges();
  count_blobs();
  snapshot.timecode = timecode_ ? timecode_at(*timecode_, snapshot.instants.exposed_at) : std::nullopt;
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
  if (fusion_->fit() && links_.takes != nullptr && !links_.takes->fits.try_push(*fusion_->fit())) {
    counters_.dropped_fits.add();
  }
  if (fusion_->search() != nullptr && links_.search != nullptr) {
    static_cast<void>(links_.search->reports.try_push(*fusion_->search()));
    links_.search->there_is_work.signal();
  }
  if (links_.markers != nullptr && links_.markers->wanted.load(std::memory_order_acquire)) send_markers(snapshot);
  if (!push(snapshot, *links_.publish, stop)) counters_.dropped_publish_full.add();
  if (links_.side != nullptr && !push(snapshot, *links_.side, stop)) counters_.dropped_side_full.add();
  if (links_.takes != nullptr && !push(snapshot, *links_.takes, stop)) counters_.dropped_take_full.add();
  if (links_.beliefs != nullptr) send_belief(snapshot);
}

// While the last belief waits in the queue, there is no new one.
void FusionWorker::send_belief(const Snapshot& snapshot) {
  const Timestamp at = snapshot.instants.exposed_at;
  if (at - belief_sent_at_ < kBeliefPeriod) return;
  Belief* belief = links_.beliefs->vacant();
  if (belief == nullptr) return;
  belief_sent_at_ = at;
  Archive members = Archive::writer({belief->memory.get(), kMostBeliefBytes});
  fusion_->archive(members);
  if (!members.ok()) return;
  belief->after_set = snapshot.number;
  belief->at = at;
  belief->size = members.size();
  links_.beliefs->push();
}

void FusionWorker::send_markers(const Snapshot& snapshot) {
  if (!links_.markers->markers.try_push(measured_markers(snapshot))) {
    links_.markers->dropped.fetch_add(1, std::memory_order_relaxed);
  }
}

bool FusionWorker::push(const Snapshot& snapshot, SnapshotChannel& to, const std::stop_token& stop) {
  for (;;) {
    const WakeSignal::Ticket ticket = to.room.ticket();
    if (to.snapshots.try_push(snapshot)) break;
    if (!settings_.lossless || (stop.stop_requested() && !pausing())) return false;
    counters_.beats.add();
    to.room.wait(ticket, kStopCheckPeriod);
  }
  to.there_is_work.signal();
  return true;
}

// Executes the orders of operators and answers them.
void FusionWorker::follow_orders() {
  if (links_.control == nullptr) return;
  SubjectOrder order;
  while (links_.control->to_fusion.try_pop(order)) {
    std::string_view words;
    switch (order.action) {
      case SubjectAction::Add:
        fusion_->set_away(order.subject, false);
        words = "is searched for";
        break;
      case SubjectAction::Remove:
        fusion_->set_away(order.subject, true);
        words = "is away";
        break;
      case SubjectAction::Reset:
        fusion_->reset(order.subject);
        words = "reset; the next T-pose or A-pose gives its position and its fit";
        break;
      case SubjectAction::Fit:
        fusion_->refit(order.fit);
        words = "has the given fit from the next set on";
        break;
    }
    OrderDone done;
    done.order = order.number;
    done.done = true;
    for (const char c : words) done.message.push_back(c);
    static_cast<void>(links_.control->from_fusion.try_push(done));
  }
}

void FusionWorker::follow_timecode() {
  if (links_.timecode == nullptr) return;
  while (links_.timecode->to_fusion.try_pop(timecode_)) {
  }
}

void FusionWorker::update_rig_gauges() {
  const drift::CameraDrift* drift = fusion_->drift();
  if (drift == nullptr || fusion_->assessed().value >= links_.cameras.size()) return;
  RigGauges& rig = links_.cameras[fusion_->assessed().value]->rig;
  rig.off_px.set(drift->off_px);
  rig.turned_rad.set(drift->turned_rad);
  rig.moved_m.set(drift->moved_m);
  rig.drifted.set(drift->drifted ? 1.0 : 0.0);
}

void FusionWorker::count_blobs() {
  for (std::uint32_t i = 0; i < links_.cameras.size(); ++i)
    links_.cameras[i]->blob_use.add(fusion_->blob_use(CameraId{i}));
}

// Sends the timing of each camera to the publish thread, which logs changes.
void FusionWorker::send_timing() {
  if (settings_.lossless || host_now() - timing_sent_at_ < kTimingPeriod) return;
  timing_sent_at_ = host_now();
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
