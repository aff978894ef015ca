#include "chaos/take_desk.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <utility>

#include "chaos/hash.h"
#include "take/recorder/take_recorder.h"
#include "take/take_edit.h"
#include "take/take_reader.h"
#include "wire/codec/control_codec.h"
#include "wire/codec/encode.h"

namespace mocap::chaos {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMemory_mb = 8;
constexpr Duration kBefore = std::chrono::seconds(2);

take::TakesSettings takes_in(const fs::path& folder) {
  take::TakesSettings settings;
  settings.folder = folder;
  settings.min_free_mb = 1;
  settings.before = kBefore;
  settings.memory_mb = kMemory_mb;
  return settings;
}

// Without the difference of the clocks, which the recorder adds.
std::uint64_t hash_of(v1::Snapshot message) {
  message.clear_utc_minus_host_ns();
  Hash hash;
  hash.add(message.SerializeAsString());
  return hash.value();
}

// As the recorder encodes a snapshot.
std::uint64_t hash_of(const Snapshot& snapshot) {
  v1::Snapshot message;
  wire::encode(snapshot, message);
  if (snapshot.delivering_cameras > 0) message.set_delivering_cameras(snapshot.delivering_cameras);
  return hash_of(message);
}

bool is_in_progress(const TakeHealth& health) { return health.state == TakeState::Recording; }

fs::path path_of(const TakeHealth& health) { return std::string(health.path.begin(), health.path.end()); }

}  // namespace

// Limits the size of the files that this process writes, in place of a full disk: what does not fit fails with EFBIG.
struct TakeDesk::Limit {
  explicit Limit(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before);
    const rlimit limit{bytes, before.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~Limit() { ::setrlimit(RLIMIT_FSIZE, &before); }
  Limit(const Limit&) = delete;
  Limit& operator=(const Limit&) = delete;

  rlimit before{};
};

TakeDesk::TakeDesk(fs::path folder, const Description& description, std::function<void(const fs::path&)> after_end)
    : folder_(std::move(folder)),
      recorder_(take::make_take_recorder(takes_in(folder_), description, {})),
      after_end_(std::move(after_end)) {}

TakeDesk::~TakeDesk() = default;

void TakeDesk::note(const std::string& what, const Finding& finding) {
  if (finding && !finding_) finding_ = what + ": " + *finding;
}

void TakeDesk::keep(const BlobFrame& frame) { recorder_->keep(frame); }

void TakeDesk::keep(const Snapshot& snapshot) {
  kept_[snapshot.number] = hash_of(snapshot);
  recorder_->keep(snapshot);
}

void TakeDesk::learn(const SubjectFit& fit) { recorder_->learn(fit); }

void TakeDesk::describe(const Description& description, Timestamp now) { recorder_->describe(description, {}, now); }

void TakeDesk::order(TakeAction action, Duration before, Timestamp now) {
  ControlRequest request;
  request.action = ControlAction::Take;
  request.take.action = action;
  if (action == TakeAction::Start) request.take.before = std::min(before, kBefore);
  const std::string sent = wire::encode(request).SerializeAsString();
  v1::Request message;
  if (!message.ParseFromString(sent)) return note("control", "the request is no message");
  Result<ControlRequest> received = wire::decode(message);
  if (!received) return note("control", received.error().message);
  if (wire::encode(*received).SerializeAsString() != sent) return note("control", "the decoded request differs");
  received->take.number = ++orders_;
  ++open_orders_;
  received->take.at = now;
  recorder_->follow(received->take);
  work(now);
}

void TakeDesk::work(Timestamp now) {
  const fs::path before = std::exchange(open_take_, {});
  recorder_->work(now);
  follow_answers();
  const TakeHealth health = recorder_->health();
  if (is_in_progress(health)) open_take_ = path_of(health);
  if (before.empty() || before == open_take_) return;
  if (health.state == TakeState::Cancelled && path_of(health) == before) {
    if (fs::exists(before)) note("take", "a cancelled take is still there");
    return;
  }
  check_ended(before, health.state == TakeState::Ended);
}

void TakeDesk::follow_answers() {
  while (const auto answer = recorder_->next_answer()) {
    if (answer->order == 0 || answer->order > orders_ || open_orders_ == 0) note("take", "an answer without an order");
    if (open_orders_ > 0) --open_orders_;
  }
}

void TakeDesk::finish(Timestamp now) {
  free_disk();
  work(now);
  const fs::path open = std::exchange(open_take_, {});
  recorder_->finish(now, {});
  follow_answers();
  if (open_orders_ != 0) note("take", fmt::format("{} orders have no answer", open_orders_));
  if (!open.empty()) check_ended(open, recorder_->health().state == TakeState::Ended);
}

void TakeDesk::check_ended(const fs::path& take, bool whole) {
  if (after_end_) after_end_(take);
  if (removed_ && !fs::exists(take)) return;
  Finding fault = take_is_whole(take);
  if (fault && !whole) {
    free_disk();
    const auto repaired = take::repair_take(take);
    fault = repaired ? take_is_whole(take) : Finding(repaired.error().message);
  }
  note("take", fault);
  if (!fault) compare(take);
}

void TakeDesk::compare(const fs::path& take) {
  const auto reader = take::TakeReader::open(take);
  if (!reader) return note("take", reader.error().message);
  take::TakeCursor cursor = reader->messages({.topics = {take::TakeTopic::Snapshot}});
  for (;;) {
    const auto record = cursor.next();
    if (!record) return note("take", record.error().message);
    if (!*record) return;
    const auto message = take::snapshot_message_of(**record);
    if (!message) return note("take", message.error().message);
    const auto kept = kept_.find(message->number());
    if (kept == kept_.end()) return note("take", fmt::format("set {} was never made", message->number()));
    if (kept->second == hash_of(*message)) {
      ++taken_snapshots_;
      continue;
    }
    return note("take", fmt::format("set {} differs from the one that was recorded", message->number()));
  }
}

void TakeDesk::cut(double kept) {
  if (open_take_.empty() || !fs::exists(open_take_)) return;
  const fs::path copy = folder_ / "cut.mcap";
  std::error_code error;
  fs::copy_file(open_take_, copy, fs::copy_options::overwrite_existing, error);
  if (error) return;
  const auto size = static_cast<double>(fs::file_size(copy));
  fs::resize_file(copy, static_cast<std::uintmax_t>(kept * size));
  const auto repaired = take::repair_take(copy);
  if (repaired) {
    note("cut take", take_is_whole(copy));
    compare(copy);
  }
  fs::remove(copy, error);
}

void TakeDesk::fill_disk(double free_bytes) {
  const bool open = !open_take_.empty() && fs::exists(open_take_);
  const auto size = open ? static_cast<double>(fs::file_size(open_take_)) : 0.0;
  free_disk();  // each limit restores the one before it
  limit_ = std::make_unique<Limit>(static_cast<rlim_t>(size + free_bytes));
}

void TakeDesk::free_disk() { limit_.reset(); }

void TakeDesk::remove_folder() {
  removed_ = true;
  std::error_code ignored;
  fs::remove_all(folder_, ignored);
}

}  // namespace mocap::chaos
