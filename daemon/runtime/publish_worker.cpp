#include "runtime/publish_worker.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr std::size_t kLongestError = 255;

std::string not_synchronised(const synchronise::CameraTiming& timing) {
  return fmt::format(
      "not synchronised: exposes {:.1f} ms off the others, drifting {:.0f} us/s, at {:.2f} Hz; its views are left out "
      "of most sets or blur them; trigger all cameras by one signal, or let one PTP clock drive them",
      1e-3 * to_us(timing.offset), timing.drift_us_s, timing.rate_hz);
}

// Says it when it changes.
void learn_timing(CameraHealth& health, const synchronise::CameraTiming& timing) {
  if (!timing.is_known) return;
  health.offset_us = to_us(timing.offset);
  health.drift_us_s = timing.drift_us_s;
  health.jitter_us = to_us(timing.jitter);
  if (health.synchronised == timing.synchronised) return;
  health.synchronised = timing.synchronised;
  if (timing.synchronised) {
    log_info("camera " + health.name, "exposes together with the others again");
  } else {
    log_warn("camera " + health.name, not_synchronised(timing));
  }
}

}  // namespace

PublishWorker::PublishWorker(std::unique_ptr<Publisher> publisher, Description description,
                             PublishWorkerSettings settings, Links links, PublishCounters& counters)
    : publisher_(std::move(publisher)),
      description_(std::move(description)),
      settings_(std::move(settings)),
      links_(std::move(links)),
      counters_(counters),
      frames_reported_(links_.cameras.size(), 0) {
  health_.cameras.resize(links_.cameras.size());
  faults_.resize(links_.cameras.size());
  for (std::size_t i = 0; i < health_.cameras.size(); ++i) {
    health_.cameras[i].name = description_.cameras[i].name;
    health_.cameras[i].last_error.reserve(kLongestError);  // filled in the loop without allocating
  }
}

void PublishWorker::run() {
  const Status allowed = apply_to_this_thread(settings_.thread);
  if (!allowed) log_warn("publish", allowed.error().message);
  const Status described = publisher_->describe(description_);
  if (!described) log_error("publish", described.error().message);
  reported_at_ = host_now();

  for (;;) {
    counters_.beats.add();
    const WakeSignal::Ticket ticket = links_.snapshots->there_is_work.ticket();
    const bool ended = links_.snapshots->ended.load(std::memory_order_acquire);
    const bool sent = send_what_waits();
    if (!sent) publisher_->serve();
    report_when_due();
    if (sent) continue;
    if (ended) break;
    if (settings_.waiting == Waiting::Spin) continue;
    const Duration until_report = reported_at_ + settings_.report_every - host_now();
    links_.snapshots->there_is_work.wait(ticket, std::clamp(until_report, Duration{1}, kServeEvery));
  }
}

void PublishWorker::learn_fits() {
  SubjectFit fit;
  while (links_.snapshots->fits.try_pop(fit)) {
    MarkerSet& set = description_.subjects[fit.subject.value].marker_set;
    for (std::size_t i = 0; i < set.skeleton.bones.size(); ++i) {
      set.skeleton.bones[i].rest_offset_m = fit.rest_offsets_m[i];
    }
    for (std::size_t i = 0; i < set.markers.size(); ++i) set.markers[i].offset_m = fit.marker_offsets_m[i];
    description_.version = fit.description_version;
    log_info("subject " + description_.subjects[fit.subject.value].name,
             fmt::format("fitted, residual={:.1f}mm description={}", 1e3 * fit.residual_m, description_.version));
    const Status described = publisher_->describe(description_);
    if (!described) log_error("publish", described.error().message);
    if (links_.control != nullptr) static_cast<void>(links_.control->descriptions.try_push(description_));
  }
}

bool PublishWorker::send_what_waits() {
  bool any = false;
  SpscQueue<Snapshot>& queue = links_.snapshots->snapshots;
  while (Snapshot* oldest = queue.front()) {
    const bool newer_waits = !settings_.every_snapshot && !settings_.lossless && queue.size() > 1;
    if (newer_waits) {
      counters_.passed_over.add();
    } else {
      send(*oldest);
    }
    queue.pop();
    any = true;
    if (settings_.lossless) links_.snapshots->room.signal();
  }
  return any;
}

void PublishWorker::send(Snapshot& snapshot) {
  if (snapshot.description_version != description_.version) learn_fits();
  const Status sent = publisher_->publish(snapshot);
  if (links_.control != nullptr) tell_control(snapshot);
  if (sent) {
    counters_.sent.add();
    latency_.add(snapshot.instants);
  } else {
    counters_.failed.add();
    log_error("publish", sent.error().message);
  }
}

void PublishWorker::tell_control(const Snapshot& snapshot) {
  ControlChannel& control = *links_.control;
  for (const SubjectLabels& labels : snapshot.labels) {
    if (labels.subject.value >= kMaxSubjects) continue;
    control.phases[labels.subject.value].store(static_cast<int>(labels.phase), std::memory_order_relaxed);
  }
  if (control.snapshot_wanted.load(std::memory_order_relaxed) &&
      control.snapshot_wanted.exchange(false, std::memory_order_acq_rel)) {
    static_cast<void>(control.snapshots.try_push(snapshot));
  }
}

void PublishWorker::report_when_due() {
  const Timestamp now = host_now();
  if (now - reported_at_ < settings_.report_every) return;
  gather_health(now);
  if (links_.control != nullptr) static_cast<void>(links_.control->health.try_push(health_));
  const Status reported = publisher_->report(health_);
  if (!reported) log_error("publish", reported.error().message);
}

void PublishWorker::gather_health(Timestamp now) {
  const double seconds = to_s(now - reported_at_);
  reported_at_ = now;
  health_.at = now;
  health_.sets = links_.fusion->sets.read();
  health_.complete_sets = links_.fusion->complete_sets.read();
  health_.passed_over_sets = links_.fusion->passed_over_sets.read();
  health_.dropped_snapshots = links_.fusion->dropped_publish_full.read();
  health_.passed_over_snapshots = counters_.passed_over.read();
  health_.sent_snapshots = counters_.sent.read();
  health_.set_rate_hz = static_cast<double>(health_.sets - sets_reported_) / seconds;
  sets_reported_ = health_.sets;
  health_.latency = latency_.take();
  for (std::size_t i = 0; i < links_.cameras.size(); ++i) gather_camera(i, seconds);
  health_.feed = publisher_->feed();
}

void PublishWorker::gather_camera(std::size_t camera, double seconds) {
  CameraChannel& channel = *links_.cameras[camera];
  CameraHealth& health = health_.cameras[camera];
  CameraNote note;
  while (channel.notes.try_pop(note)) {
    health.phase = note.phase;
    health.last_error.assign(note.error.begin(), note.error.end());
  }
  synchronise::CameraTiming timing;
  while (channel.timings.try_pop(timing)) learn_timing(health, timing);
  health.frames = channel.counters.frames.read();
  health.missing_frames = channel.counters.missing_frames.read();
  health.failed_frames = channel.counters.failed_frames.read();
  health.dropped_queue_full = channel.counters.dropped_queue_full.read();
  health.detection = channel.counters.detection.counts();
  health.levels = channel.counters.detection.levels();
  health.reopened = channel.counters.reopened.read();
  const StreamCounters& stream = *links_.streams[camera];
  health.underruns = stream.underruns.load(std::memory_order_relaxed);
  health.resent_packets = stream.resent_packets.load(std::memory_order_relaxed);
  health.missing_packets = stream.missing_packets.load(std::memory_order_relaxed);
  health.repeated_frames = stream.repeated_frames.load(std::memory_order_relaxed);
  health.clock_leaps = stream.clock_leaps.load(std::memory_order_relaxed);
  health.clock_uncertainty_us = stream.clock_uncertainty_us.load(std::memory_order_relaxed);
  health.clock_source = stream.clock_source.load(std::memory_order_relaxed);
  health.chunk_times = stream.chunk_times.load(std::memory_order_relaxed);
  health.bumped = channel.rig.drifted.read() > 0.0;
  health.rig_off_px = channel.rig.off_px.read();
  health.rig_turned_rad = channel.rig.turned_rad.read();
  health.rig_moved_m = channel.rig.moved_m.read();
  faults_[camera].tell(health, health_.at);
  health.rate_hz = static_cast<double>(health.frames - frames_reported_[camera]) / seconds;
  frames_reported_[camera] = health.frames;
}

}  // namespace mocap::runtime
