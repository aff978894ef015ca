#include "take/recorder/take_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <string_view>
#include <utility>

#include "base/log.h"
#include "mocap/v1/event.pb.h"
#include "model/search_health.h"
#include "take/recorder/open_take.h"
#include "take/recorder/shot_list.h"
#include "take/recorder/take_folder.h"
#include "take/recorder/take_in_progress.h"
#include "take/recorder/take_intake.h"
#include "take/recorder/waiting_start.h"
#include "wire/codec/utf8.h"

namespace mocap::take {
namespace {

constexpr const char* kWho = "take";
constexpr const char* kDoesNotStart = "the take that waited does not start";
// Between two batches the memory is checked: with a disk of 10 kB/s a batch takes 4 s.
constexpr std::size_t kBatch_bytes = 1U << 17U;
constexpr int kMostBatches = 8;  // of one call of `work`
constexpr Duration kCheckPeriod = std::chrono::seconds(1);
// Longest wait for the snapshots of the take's last instants; the second one while images came that may belong to them.
constexpr Duration kDrainPatience = std::chrono::milliseconds(300);
constexpr Duration kLongDrainPatience = kLongestSet + kDrainPatience;
// Between two takes of take next nothing must leave the memory.
constexpr Duration kLeastKept = std::chrono::seconds(2);
static_assert(kLeastKept > kLongDrainPatience);

TakeOutcome outcome_of(const Error& error) {
  return error.code == ErrorCode::InvalidArgument ? TakeOutcome::Invalid : TakeOutcome::Failed;
}

class DiskTakeRecorder : public TakeRecorder {
 public:
  DiskTakeRecorder(TakesSettings settings, const Description& description, std::vector<TakeFile> files)
      : settings_(std::move(settings)),
        intake_(settings_, kLeastKept, description, std::move(files)),
        folder_(settings_),
        shots_(settings_.shots) {
    if (const Status loaded = shots_.load(); !loaded) log_error(kWho, loaded.error().message);
  }

  void keep(const BlobFrame& frame) override { intake_.keep(frame); }
  void keep(const Snapshot& snapshot) override { intake_.keep(snapshot); }
  void keep(const Health& health) override { intake_.keep(health); }
  void keep(const Belief& belief) override { intake_.keep(belief); }
  void learn(const SubjectFit& fit) override { intake_.learn(fit); }
  void count_dropped(std::uint64_t images, std::uint64_t sets) override { intake_.count_dropped(images, sets); }
  void describe(const Description& description, std::vector<TakeFile> files, Timestamp now) override {
    intake_.describe(description, std::move(files), now);
  }

  void follow(const TakeOrder& order) override {
    switch (order.action) {
      case TakeAction::Start: return order_start(order);
      case TakeAction::Stop: return order_stop(order);
      case TakeAction::Cancel: return order_cancel(order);
      case TakeAction::Mark: return order_mark(order);
      case TakeAction::Next: return order_next(order);
      case TakeAction::ListShots: return answer_shots(order, shots_.words());
      case TakeAction::ImportShots:
      case TakeAction::ClearShots: return order_shots(order);
    }
  }

  void set_timecode(const TimecodeHealth& timecode, Timestamp now) override { waiting_.set_timecode(timecode, now); }

  bool work(Timestamp now) override {
    if (!recording_) start_next();
    if (const auto due = waiting_.take_due(now)) start_due(*due);
    Timestamp written_until = now;
    for (int i = 0; recording_ && i < kMostBatches; ++i) {
      const auto written = write_waiting();
      written_until = written.value_or(now);
      if (recording_) check(now);
      if (!written) break;
    }
    if (recording_ && is_over(written_until)) {
      end(now, {});
    } else if (recording_) {
      if (const Status ticked = recording_->writer->tick(now); !ticked) end(now, ticked.error().message);
    }
    return next_ && !recording_;
  }

  std::optional<TakeDone> next_answer() override {
    if (answers_.empty()) return std::nullopt;
    TakeDone next = std::move(answers_.front());
    answers_.pop_front();
    return next;
  }

  TakeHealth health() const override {
    TakeHealth health = state_;
    if (!recording_) return health;
    write_quality(recording_->meter.report(), health);
    health.size_bytes = recording_->writer->size().bytes;
    return health;
  }

  void finish(Timestamp now, const std::string& why) override {
    drop_next("the recorder ends");
    if (waiting_.cancel())
      log_warn(kWho, fmt::format("the take that waited does not start: {}", why.empty() ? "mocapd ends" : why));
    if (!recording_) return;
    const bool stopped = is_stopped(now);
    stop_at(now);
    while (recording_ && write_waiting()) continue;
    if (recording_) end(now, stopped ? std::string() : why);
  }

 private:
  // --- orders ---

  void answer(const TakeOrder& order, TakeOutcome outcome, std::string message) {
    answers_.push_back({order.number, outcome, std::move(message)});
  }

  void order_start(const TakeOrder& order) {
    if (!recording_ || is_stopped(order.at)) return order_next(order);
    answer(order, TakeOutcome::Failed,
           fmt::format("take '{}' is being recorded; mocapctl take stop ends it, mocapctl take next begins another one",
                       recording_->info.name));
  }

  // The take in progress ends first, at the instant of the order. An order that cannot be followed changes nothing.
  void order_next(const TakeOrder& order) {
    if (next_) return answer(order, TakeOutcome::Failed, "the next take is about to start already");
    if (waiting_.waits()) {
      return answer(order, TakeOutcome::Failed, "a take waits for its start already; mocapctl take cancel ends that");
    }
    for (const Status& valid : {folder_.check_order(order), waiting_.check(order)}) {
      if (!valid) return answer(order, TakeOutcome::Invalid, valid.error().message);
    }
    if (!recording_) return start_or_wait(order, order.at);
    const bool follows = order.action == TakeAction::Next;
    stop_at(order.at);
    next_ = Next{order, follows ? *recording_->to : order.at};
  }

  void start_or_wait(const TakeOrder& order, Timestamp at) {
    if (!order.at_timecode && wait_of(order, at) <= Duration::zero()) return start_now(order, at);
    const Result<std::string> waits = waiting_.begin(order, at);
    if (!waits) return answer(order, TakeOutcome::Invalid, waits.error().message);
    begin_state(TakeState::Waiting);
    state_.name = bounded_text<255>(order.name);
    answer(order, TakeOutcome::Done, *waits);
  }

  void start_next() {
    if (const auto next = std::exchange(next_, std::nullopt)) start_or_wait(next->order, next->at);
  }

  // Whether an order for the take `ordered` is about this take; empty: an order for any take, or a name to be chosen.
  static bool is_about(std::string_view ordered, std::string_view take) {
    return ordered.empty() || take.empty() || ordered == take;
  }

  // Returns whether the take `ordered` was about to start.
  bool drop_next(const std::string& why, std::string_view ordered = {}) {
    if (next_ && !is_about(ordered, next_->order.name)) return false;
    const auto next = std::exchange(next_, std::nullopt);
    if (next) answer(next->order, TakeOutcome::Failed, fmt::format("{}: {}", kDoesNotStart, why));
    return next.has_value();
  }

  void start_due(const WaitingStart::Due& due) {
    const TakeDone started = start(due.order, due.at);
    if (started.outcome == TakeOutcome::Done) return;
    state_.state = TakeState::Failed;
    state_.message = bounded_text<511>(started.message);
    log_error(kWho, started.message);
  }

  void start_now(const TakeOrder& order, Timestamp now) {
    TakeDone started = start(order, now);
    if (started.outcome == TakeOutcome::Failed) log_error(kWho, started.message);
    answers_.push_back(std::move(started));
  }

  // Whether the take in progress is over at this instant, and only waits for its last messages.
  bool is_stopped(Timestamp at) const { return recording_->to && *recording_->to <= at; }
  void stop_at(Timestamp at) {
    if (!is_stopped(at)) recording_->to = at;
  }

  void order_stop(const TakeOrder& order) {
    const bool dropped = drop_next("a stop came first", order.name);
    const bool is_it = recording_ && is_about(order.name, recording_->info.name);
    if (is_it && !recording_->stopped_by) {
      stop_at(order.at);
      recording_->stopped_by = order;
      return;
    }
    if (dropped) return answer(order, TakeOutcome::Done, kDoesNotStart);
    if (is_it) return answer(order, TakeOutcome::Failed, "the take is being stopped already");
    order_cancel(order);  // of a take that waits for its start
  }

  // A take that was stopped is no longer cancelled, even if its file is not complete yet.
  void order_cancel(const TakeOrder& order) {
    if (drop_next("it was cancelled", order.name)) return answer(order, TakeOutcome::Done, kDoesNotStart);
    if (recording_ && !is_stopped(order.at) && is_about(order.name, recording_->info.name)) return cancel(order);
    if (!is_about(order.name, text_of(state_.name)) || !waiting_.cancel()) return answer_not_found(order);
    state_.state = TakeState::Cancelled;
    answer(order, TakeOutcome::Done, kDoesNotStart);
  }

  void answer_not_found(const TakeOrder& order) {
    const std::string none = "no take is being recorded; mocapctl take start begins one";
    answer(order, TakeOutcome::NotFound,
           recording_ && !order.name.empty() ? fmt::format("'{}' is not the take in progress", order.name) : none);
  }

  void cancel(const TakeOrder& order) {
    const std::string path = recording_->writer->path();
    set_shot_done(recording_->shot, false);
    (void)recording_->writer->finish(recording_->info);
    recording_.reset();
    intake_.buffer().release();
    std::error_code error;
    std::filesystem::remove(path, error);
    state_.state = TakeState::Cancelled;
    if (error) {
      return answer(order, TakeOutcome::Failed, fmt::format("'{}' cannot be deleted: {}", path, error.message()));
    }
    log_info(kWho, fmt::format("'{}' cancelled and deleted", path));
    answer(order, TakeOutcome::Done, fmt::format("{}: cancelled and deleted", path));
  }

  void order_mark(const TakeOrder& order) {
    if (!recording_)
      return answer(order, TakeOutcome::NotFound, "no take is being recorded, so there is nothing to mark");
    v1::Event event;
    event.set_at_ns(to_ns(order.at));
    event.set_kind(v1::EVENT_KIND_MARK);
    event.set_message(wire::valid_utf8(order.text));
    const Status written = recording_->writer->append(kEventTopic, order.at, event.SerializeAsString());
    if (!written) {
      answer(order, TakeOutcome::Failed, written.error().message);
      return end(order.at, written.error().message);
    }
    answer(order, TakeOutcome::Done,
           fmt::format("{}: marked at {:.3f} s", recording_->info.name, to_s(order.at - recording_->from)));
  }

  void order_shots(const TakeOrder& order) {
    const std::size_t before = shots_.shots().size(), left = shots_.left();
    if (const Status replaced = shots_.replace(order.shots); !replaced)
      return answer(order, outcome_of(replaced.error()), replaced.error().message);
    std::string words = order.shots.empty() ? "the shot list is empty now" : shots_.words();
    if (before > 0) words += fmt::format("; the list before had {} shots, {} of them not recorded", before, left);
    log_info(kWho, words);
    answer_shots(order, words);
  }

  void answer_shots(const TakeOrder& order, std::string message) {
    answer(order, TakeOutcome::Done, std::move(message));
    answers_.back().shots = shots_.shots();
  }

  void set_shot_done(const std::string& name, bool done) {
    if (name.empty()) return;
    if (const Status saved = shots_.set_done(name, done); !saved) log_error(kWho, saved.error().message);
  }

  // --- a take ---

  // `written_until`: now, or while messages wait for the disk the instant of the last one that was written.
  bool is_over(Timestamp written_until) const {
    if (!recording_->to) return false;
    const Duration patience = recording_->awaits_set() ? kLongDrainPatience : kDrainPatience;
    return recording_->drained || written_until > *recording_->to + patience;
  }

  // `take next` takes the next shot of the list, if there is one.
  TakeDone start(const TakeOrder& order, Timestamp now) {
    const Shot* shot = order.action == TakeAction::Next && order.name.empty() ? shots_.next() : nullptr;
    if (shot == nullptr) return start_take(order, now);
    const std::string name = shot->name;
    TakeDone started = start_take(folder_.with_shot(order, *shot), now);
    if (started.outcome != TakeOutcome::Done) return started;
    recording_->shot = name;
    set_shot_done(name, true);
    const Shot* next = shots_.next();
    started.message += fmt::format(
        "; shot '{}', {}", name,
        next == nullptr ? "the last one of the list" : fmt::format("{} left, next '{}'", shots_.left(), next->name));
    return started;
  }

  TakeDone start_take(const TakeOrder& order, Timestamp now) {
    Result<TakeInProgress> opened = open_take(order, now, slate_, settings_, folder_, intake_);
    if (!opened) return {order.number, outcome_of(opened.error()), opened.error().message};
    recording_ = *std::move(opened);
    slate_ = recording_->info.slate;
    begin_state(TakeState::Recording);
    ++state_.takes;
    state_.name = bounded_text<255>(recording_->info.name);
    state_.path = bounded_text<1023>(recording_->writer->path());
    const std::string words =
        fmt::format("recording '{}', from {:.1f} s before", recording_->writer->path(), to_s(now - recording_->from));
    log_info(kWho, words);
    return {order.number, TakeOutcome::Done, words};
  }

  void begin_state(TakeState state) {
    const std::uint64_t takes = state_.takes;
    state_ = {};
    state_.state = state;
    state_.takes = takes;
  }

  void check(Timestamp now) {
    const TakeBuffer::Lost lost = intake_.buffer().lost();
    const TakeIntake::Dropped dropped = intake_.dropped(), before = recording_->dropped_before;
    recording_->meter.set_lost(lost.images + dropped.images - before.images, dropped.sets - before.sets);
    if (lost.images + lost.others > 0) {
      return end(now,
                 fmt::format("the disk is too slow: {} MB wait to be written ([takes] memory_mb); use a faster disk "
                             "for [takes] folder",
                             settings_.memory_mb));
    }
    if (now - recording_->checked_at < kCheckPeriod) return;
    recording_->checked_at = now;
    for (const Status& good : {check_file(recording_->writer->path()), folder_.check_space()}) {
      if (!good) return end(now, good.error().message);
    }
  }

  // Returns the instant of the last message; nothing if none waited or the take ended.
  std::optional<Timestamp> write_waiting() {
    const std::vector<BufferedMessage>& batch = intake_.buffer().next(kBatch_bytes);
    for (const BufferedMessage& message : batch) {
      if (message.kind == BufferedKind::Break) {
        end(message.at, is_stopped(message.at) ? "" : "the cameras of the configuration changed");
        return std::nullopt;
      }
      if (const Status written = recording_->write(message); !written) {
        end(message.at, written.error().message);
        return std::nullopt;
      }
    }
    return batch.empty() ? std::nullopt : std::optional(batch.back().at);
  }

  // Completes the file. `why`: the reason of an early end; empty: as ordered.
  void end(Timestamp now, const std::string& why) {
    TakeInProgress ended = *std::exchange(recording_, std::nullopt);
    intake_.buffer().release();
    note_first_set(intake_, ended.info);  // there may have been none yet when the take began
    const QualityReport report = ended.meter.report();
    const Status finished = ended.finish(now, report, why);
    write_quality(report, state_);
    state_.size_bytes = ended.writer->size().bytes;
    const std::string fault = !why.empty() ? why : finished ? std::string() : finished.error().message;
    state_.state = fault.empty() ? TakeState::Ended : TakeState::Failed;
    state_.message = bounded_text<511>(fault);
    const std::string words = ended.words(report, fault);
    fault.empty() ? log_info(kWho, words) : log_error(kWho, words + "; the feed continues");
    const TakeOutcome outcome = fault.empty() ? TakeOutcome::Done : TakeOutcome::Failed;
    if (ended.stopped_by) answer(*ended.stopped_by, outcome, words);
  }

  const TakesSettings settings_;
  TakeIntake intake_;
  const TakeFolder folder_;

  // Used by the disk thread only.
  std::optional<TakeInProgress> recording_;
  WaitingStart waiting_;
  struct Next {
    TakeOrder order;
    Timestamp at;  // the instant at which the take starts
  };
  std::optional<Next> next_;  // starts with the first `work` after the end of the take in progress
  std::deque<TakeDone> answers_;
  std::string slate_ = "take";
  ShotList shots_;
  TakeHealth state_;
};

}  // namespace

std::unique_ptr<TakeRecorder> make_take_recorder(const TakesSettings& settings, const Description& description,
                                                 std::vector<TakeFile> files) {
  log_info(kWho, fmt::format("ready to record to '{}'; the last {:.0f} s are kept in at most {} MB of memory",
                             settings.folder.string(), to_s(settings.before), settings.memory_mb));
  return std::make_unique<DiskTakeRecorder>(settings, description, std::move(files));
}

}  // namespace mocap::take
