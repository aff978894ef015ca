#include "runtime/publish_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "base/log.h"

namespace mocap::runtime {
namespace {

constexpr std::size_t kLongestError = 255;
// A reason that was not renewed for so long is dropped: no frame sets, or the subject is away. Reports come every
// second.
constexpr Duration kReasonLasts = std::chrono::seconds(3);

// Without snapshots for this long (capture is stopped, all cameras are away), new clients are served at the longer
// period: they join within 0.1 s, and the thread costs next to nothing.
constexpr Duration kIdleAfter = std::chrono::seconds(1);
constexpr Duration kServeEveryIdle = std::chrono::milliseconds(50);
constexpr Duration kAskForPreviewsEvery = std::chrono::milliseconds(50);

std::string not_synchronised(const synchronise::CameraTiming& timing) {
  return fmt::format(
      "not synchronised: exposes {:.1f} ms off the others, drifting {:.0f} us/s, at {:.2f} Hz; most sets lack its "
      "views "
      "or are less accurate with them; trigger all cameras by one signal, or synchronise them with one PTP clock",
      1e-3 * to_us(timing.offset), timing.drift_us_s, timing.rate_hz);
}

// Updates the timing of a camera and logs a change of `synchronised`.
void update_timing(CameraHealth& health, const synchronise::CameraTiming& timing) {
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
      frames_reported_(links_.cameras.size(), 0),
      searches_(kMaxSubjects) {
  health_.searches.reserve(kMaxSubjects);
  health_.cameras.resize(links_.cameras.size());
  faults_.resize(links_.cameras.size());
  for (std::size_t i = 0; i < health_.cameras.size(); ++i) {
    health_.cameras[i].name = description_.cameras[i].name;
    health_.cameras[i].last_error.reserve(kLongestError);  // the loop assigns without allocating
  }
  list_recordings();
}

void PublishWorker::list_recordings() {
  health_.recordings.clear();
  for (const RecordingProgress* recording : links_.recordings) {
    health_.recordings.push_back({recording->path(), RecordingState::Recording, 0, 0, {}});
    health_.recordings.back().error.reserve(kLongestError);
  }
}

void PublishWorker::change(Description description, PublishWorkerSettings settings, Links links) {
  std::vector<CameraHealth> cameras(links.cameras.size());
  std::vector<std::uint64_t> frames_reported(links.cameras.size(), 0);
  std::vector<CameraFaults> faults(links.cameras.size());
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    cameras[i].name = description.cameras[i].name;
    cameras[i].last_error.reserve(kLongestError);
    const auto same = std::ranges::find(links_.cameras, links.cameras[i]);
    if (same == links_.cameras.end()) continue;
    const auto before = static_cast<std::size_t>(same - links_.cameras.begin());
    cameras[i] = std::move(health_.cameras[before]);
    frames_reported[i] = frames_reported_[before];
    faults[i] = faults_[before];
  }
  health_.cameras = std::move(cameras);
  frames_reported_ = std::move(frames_reported);
  faults_ = std::move(faults);
  description_ = std::move(description);
  settings_ = std::move(settings);
  links_ = std::move(links);
  if (links_.timecode == nullptr) health_.timecode = {};
  searches_.assign(kMaxSubjects, {});  // indices of subjects may differ
  list_recordings();
}

void PublishWorker::run() {
  const Status allowed = apply_to_this_thread(settings_.thread);
  if (!allowed) log_warn("publish", allowed.error().message);
  const Status described = publisher_->describe(description_);
  if (!described) log_error("publish", described.error().message);
  Timestamp sent_at = host_now();
  if (reported_at_ == Timestamp{}) reported_at_ = sent_at;  // after a pause, the next report is due as before

  for (;;) {
    counters_.beats.add();
    const WakeSignal::Ticket ticket = links_.snapshots->there_is_work.ticket();
    const bool ended = links_.snapshots->ended.load(std::memory_order_acquire);
    const bool sent = send_waiting();
    if (!sent) publisher_->serve();
    report_when_due();
    send_preview();
    if (sent) {
      sent_at = host_now();
      continue;
    }
    if (ended) break;
    if (pausing()) return apply_fits(std::numeric_limits<std::uint32_t>::max());
    if (settings_.waiting == Waiting::Spin) continue;
    const Timestamp now = host_now();
    const Duration until_report = reported_at_ + settings_.report_every - now;
    const Duration serve_every = now - sent_at > kIdleAfter ? kServeEveryIdle : kServeEvery;
    links_.snapshots->there_is_work.wait(ticket, std::clamp(until_report, Duration{1}, serve_every));
  }
}

// Fusion may be ahead: a fit of a later snapshot waits for it.
void PublishWorker::apply_fits(std::uint32_t version) {
  SubjectFit fit;
  while (description_.version < version && links_.snapshots->fits.try_pop(fit)) {
    description_ = with_fit(std::move(description_), fit);
    log_info("subject " + description_.subjects[fit.subject.value].name,
             fmt::format("fitted, residual={:.1f}mm description={}", 1e3 * fit.residual_m, description_.version));
    const Status described = publisher_->describe(description_);
    if (!described) log_error("publish", described.error().message);
    if (links_.control != nullptr) static_cast<void>(links_.control->descriptions.try_push(description_));
  }
}

bool PublishWorker::send_waiting() {
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
  apply_fits(snapshot.description_version);
  const Status sent = publisher_->publish(snapshot);
  for (const SubjectLabels& labels : snapshot.labels) {
    if (labels.subject.value >= kMaxSubjects) continue;
    Search& search = searches_[labels.subject.value];
    search.is_tracked = labels.phase == SubjectPhase::Tracking;
    if (search.is_tracked) search.received_at.reset();
  }
  if (links_.control != nullptr) update_control(snapshot);
  if (sent) {
    counters_.sent.add();
    latency_.add(snapshot.instants);
  } else {
    counters_.failed.add();
    log_error("publish", sent.error().message);
  }
}

void PublishWorker::update_control(const Snapshot& snapshot) {
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
  if (links_.timecode != nullptr) {
    while (links_.timecode->to_publish.try_pop(health_.timecode)) {
    }
  }
  const Timestamp now = host_now();
  if (now - reported_at_ < settings_.report_every) return;
  gather_health(now);
  if (links_.control != nullptr) static_cast<void>(links_.control->health.try_push(health_));
  if (links_.takes != nullptr) static_cast<void>(links_.takes->health.try_push(health_));
  const Status reported = publisher_->report(health_);
  if (!reported) log_error("publish", reported.error().message);
}

// Sends one preview in each iteration, so that several at once do not fill the send queue of a subscriber (wire,
// decisions/0005).
void PublishWorker::send_preview() {
  if (links_.previews == nullptr) return;
  if (const Preview* preview = links_.previews->previews.front()) {
    const Status sent = publisher_->send_preview(*preview);
    if (!sent) log_error("publish", sent.error().message);
    links_.previews->previews.pop();
  }
  const Timestamp now = host_now();
  if (now - asked_for_previews_at_ < kAskForPreviewsEvery) return;
  asked_for_previews_at_ = now;
  ask_for_previews();
}

void PublishWorker::ask_for_previews() {
  for (std::uint32_t i = 0; i < links_.cameras.size(); ++i) {
    links_.cameras[i]->preview.set_wanted(publisher_->wants_preview(CameraId{i}));
  }
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
  health_.latency_totals = latency_.totals();
  for (std::size_t i = 0; i < links_.cameras.size(); ++i) gather_camera(i, seconds);
  health_.feed = publisher_->feed();
  if (links_.audit != nullptr) health_.audit = links_.audit->health();
  gather_recordings();
  if (links_.takes != nullptr) {
    while (links_.takes->states.try_pop(health_.take)) {
    }
  }
  gather_searches(now);
}

void PublishWorker::gather_searches(Timestamp now) {
  if (links_.search == nullptr) return;
  while (const SearchHealth* newest = links_.search->reasons.front()) {
    if (newest->subject.value < searches_.size()) {
      Search& search = searches_[newest->subject.value];
      search.health = *newest;
      search.received_at = now;
    }
    links_.search->reasons.pop();
  }
  health_.searches.clear();
  for (const Search& search : searches_) {
    const bool holds = !search.is_tracked && search.received_at && now - *search.received_at < kReasonLasts &&
                       search.health.cause != SearchCause::None;
    if (holds) health_.searches.push_back(search.health);
  }
}

void PublishWorker::gather_recordings() {
  for (std::size_t i = 0; i < links_.recordings.size(); ++i) {
    const RecordingProgress& progress = *links_.recordings[i];
    RecordingHealth& health = health_.recordings[i];
    health.state = progress.state();
    health.size_bytes = progress.size().bytes;
    health.records = progress.size().records;
    if (health.state == RecordingState::Failed) health.error = progress.error();
  }
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
  while (channel.timings.try_pop(timing)) update_timing(health, timing);
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
  const BlobUse blob_use = channel.blob_use.read();
  health.marker_share = blob_use.since(health.blob_use).share();
  health.blob_use = blob_use;
  faults_[camera].report(health, health_.at);
  health.rate_hz = static_cast<double>(health.frames - frames_reported_[camera]) / seconds;
  frames_reported_[camera] = health.frames;
}

}  // namespace mocap::runtime
