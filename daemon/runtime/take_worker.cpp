#include "runtime/take_worker.h"

#include <algorithm>
#include <utility>

#include "runtime/control/audit_orders.h"
#include "runtime/process/realtime.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

// Period of the disk thread during a take: with the chunks of 50 ms, a crash loses less than 100 ms of a take.
constexpr Duration kDiskPeriod = std::chrono::milliseconds(10);
// A chunk is compressed in a burst, for which the feed shall not wait. A third of the share of a thread of default
// priority remains on a machine without idle processors, so that a take is written in time there too.
constexpr int kDiskNiceness = 5;
constexpr Duration kReportPeriod = std::chrono::milliseconds(250);
// Numbers of the trigger's orders have this bit on their way through the recorder: its answers go to the trigger
// thread.
constexpr std::uint64_t kOfTrigger = std::uint64_t{1} << 63U;

bool is_open(TakeState state) { return state == TakeState::Waiting || state == TakeState::Recording; }

}  // namespace

TakeWorker::TakeWorker(std::unique_ptr<TakeRecorder> recorder, const std::vector<CameraChannel*>& cameras,
                       SnapshotChannel& snapshots, const Links& links)
    : recorder_(std::move(recorder)),
      snapshots_(&snapshots),
      dropped_sets_{&links.dropped_sets, links.dropped_sets.read()},
      beliefs_(links.beliefs),
      channel_(links.channel),
      timecode_(links.timecode),
      wake_(links.wake),
      audit_(links.audit) {
  for (CameraChannel* camera : cameras) {
    const Counter& dropped = camera->counters.dropped_take_full;
    cameras_.push_back({camera, {&dropped, dropped.read()}});
  }
}

void TakeWorker::change(const Description& description, std::vector<TakeFile> files,
                        const std::vector<CameraChannel*>& cameras, SnapshotChannel& snapshots) {
  recorder_->describe(description, std::move(files), host_now());
  snapshots_ = &snapshots;
  const std::vector<Source> before = std::exchange(cameras_, {});
  for (CameraChannel* camera : cameras) {
    const auto same = std::ranges::find(before, camera, &Source::camera);
    cameras_.push_back(same != before.end() ? *same : Source{camera, {&camera->counters.dropped_take_full, 0}});
  }
}

void TakeWorker::run_intake(const std::stop_token& stop) {
  for (;;) {
    const WakeSignal::Ticket ticket = wake_.ticket();
    const bool ended = stop.stop_requested();
    if (take_in()) continue;
    if (ended) return;
    wake_.wait(ticket, kStopCheckPeriod);
  }
}

bool TakeWorker::take_in() {
  bool any = false;
  std::uint64_t dropped_images = 0;
  for (Source& source : cameras_) {
    SpscQueue<BlobFrame>& images = *source.camera->to_take;
    dropped_images += source.dropped.rise();
    while (const BlobFrame* oldest = images.front()) {
      recorder_->keep(*oldest);
      images.pop();
      any = true;
    }
  }
  recorder_->count_dropped(dropped_images, dropped_sets_.rise());
  while (const Snapshot* oldest = snapshots_->snapshots.front()) {
    SubjectFit fit;  // is pushed before the first snapshot that uses it
    while (snapshots_->fits.try_pop(fit)) recorder_->learn(fit);
    recorder_->keep(*oldest);
    snapshots_->snapshots.pop();
    any = true;
  }
  while (const Belief* oldest = beliefs_.front()) {
    recorder_->keep(*oldest);
    beliefs_.pop();
    any = true;
  }
  while (const Health* oldest = channel_.health.front()) {
    recorder_->keep(*oldest);
    channel_.health.pop();
  }
  return any;
}

void TakeWorker::run_disk(const std::stop_token& stop) {
  yield_to_other_threads(kDiskNiceness);
  while (!stop.stop_requested()) {
    const WakeSignal::Ticket ticket = channel_.ordered.ticket();
    TimecodeHealth timecode;
    while (timecode_.to_takes.try_pop(timecode)) recorder_->set_timecode(timecode, host_now());
    follow_orders();
    const bool starts = recorder_->work(host_now());
    report(host_now());
    note_takes();
    pass_answers();
    tell_changes();
    if (starts) continue;
    channel_.ordered.wait(ticket, is_open(reported_) ? kDiskPeriod : kStopCheckPeriod);
  }
}

// The orders of operators and triggers, in the order in which they came.
void TakeWorker::follow_orders() {
  for (;;) {
    const TakeOrder* operators = channel_.orders.front();
    const TakeOrder* triggers = channel_.trigger_orders.front();
    if (operators == nullptr && triggers == nullptr) return;
    const bool of_trigger = operators == nullptr || (triggers != nullptr && triggers->at < operators->at);
    TakeOrder order = of_trigger ? *triggers : *operators;
    (of_trigger ? channel_.trigger_orders : channel_.orders).pop();
    follow(std::move(order), of_trigger);
  }
}

void TakeWorker::follow(TakeOrder order, bool of_trigger) {
  remember_actor(order);
  const std::uint64_t number = order.number;
  if (of_trigger) {
    if (audit_ != nullptr) audit_->note(entry_of(order));
    order.number |= kOfTrigger;
  }
  recorder_->follow(order);
  note_takes();  // the next order may begin another take
  if (!of_trigger) return;
  if (!pass_answers(number)) tell({number, std::nullopt, recorder_->health()});
}

void TakeWorker::finish(const std::string& why) {
  recorder_->finish(host_now(), why);
  note_takes();
}

void TakeWorker::remember_actor(const TakeOrder& order) {
  const TakeAction action = order.action;
  if (action == TakeAction::Start || action == TakeAction::Next) starter_ = order.by;
  if (action == TakeAction::Stop || action == TakeAction::Cancel || action == TakeAction::Next) ender_ = order.by;
}

// Notes a take that began or ended since the last call. A take that ends by itself is noted as of the daemon: nobody
// ordered its end.
void TakeWorker::note_takes() {
  if (audit_ == nullptr) return;
  const TakeHealth take = recorder_->health();
  if (take.state == noted_.state && take.takes == noted_.takes) return;
  noted_ = take;
  if (take.state == TakeState::None || take.state == TakeState::Waiting) return;
  const bool began = take.state == TakeState::Recording;
  audit_->note(entry_of(take, began ? starter_ : ender_));
  ender_ = {};
  if (began) starter_ = {};
}

// Returns whether the trigger's order `awaited` was answered.
bool TakeWorker::pass_answers(std::uint64_t awaited) {
  bool came = false;
  while (auto answer = recorder_->next_answer()) {
    if ((answer->order & kOfTrigger) == 0) {
      static_cast<void>(channel_.done.try_push(*answer));
      continue;
    }
    const std::uint64_t number = answer->order &= ~kOfTrigger;
    came = came || number == awaited;
    tell({number, *std::move(answer), recorder_->health()});
  }
  return came;
}

void TakeWorker::tell(TakeNews news) {
  if (!channel_.news_wanted.load(std::memory_order_acquire)) return;
  told_ = {news.take->state, news.take->takes};
  static_cast<void>(channel_.news.try_push(news));
  channel_.news_came.signal();
}

void TakeWorker::tell_changes() {
  if (!channel_.news_wanted.load(std::memory_order_acquire)) return told_.reset();
  const TakeHealth take = recorder_->health();
  if (told_ && told_->state == take.state && told_->takes == take.takes) return;
  tell({0, std::nullopt, take});
}

void TakeWorker::report(Timestamp now) {
  const TakeHealth state = recorder_->health();
  if (state.state == reported_ && now - reported_at_ < kReportPeriod) return;
  reported_ = state.state;
  reported_at_ = now;
  static_cast<void>(channel_.states.try_push(state));
}

}  // namespace mocap::runtime
