#include "chaos/episode_run.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "assemble.h"

namespace mocap::chaos {
namespace {

constexpr std::size_t kKeptTruths = 64;
constexpr Timestamp kStart = from_ns(1'000'000'000);            // the first exposure, as SceneWorld
constexpr Duration kAfterEnd = std::chrono::milliseconds(500);  // images and takes that are under way at the end

settings::DaemonSettings settings_of(const Stage& stage, const Episode& episode) {
  settings::DaemonSettings settings;
  settings.rig = stage.rig();
  settings.subject_models = stage.subjects();
  settings.nominal_rate_hz = episode.rate_hz;
  settings.pipeline.align.patience = episode.patience;
  return settings;
}

Description description_of(const settings::DaemonSettings& settings) { return describe(settings, "chaos"); }

// The kinds of a reload, by the amount of its fault.
enum class Change { Nothing, Label, Alignment, Order, Subjects };

Change change_of(double amount) { return static_cast<Change>(std::clamp(static_cast<int>(amount), 0, 4)); }

// The performers of the subjects after a change: the order is reversed; the last subject leaves, or returns.
std::vector<std::uint32_t> cast_of(Change change, std::vector<std::uint32_t> cast, std::uint32_t performers) {
  if (change == Change::Order) std::ranges::reverse(cast);
  if (change != Change::Subjects || performers < 2) return cast;
  if (cast.size() > 1) return {cast.front()};
  return {cast.front(), performers - 1 - cast.front()};
}

// A subject is the same if its performer is.
Handover handover_of(const std::vector<std::uint32_t>& before, const std::vector<std::uint32_t>& now,
                     std::size_t cameras) {
  Handover handover;
  for (const std::uint32_t performer : now) {
    const auto same = std::ranges::find(before, performer);
    handover.subjects.push_back(same == before.end() ? SubjectId{}
                                                     : SubjectId{static_cast<std::uint32_t>(same - before.begin())});
  }
  for (std::uint32_t i = 0; i < cameras; ++i) handover.cameras.push_back(CameraId{i});
  handover.matching = handover.drift = true;
  return handover;
}

// Whether the daemon forgets the performer's body, so that only a T-pose, which does not come, gives a skeleton again.
bool needs_pose(const Episode& episode, std::uint32_t performer) {
  return std::ranges::any_of(episode.faults, [&](const Fault& fault) {
    if (fault.kind == FaultKind::SubjectReset) return fault.target == performer;
    return !episode.fitted && fault.kind == FaultKind::Reload && change_of(fault.amount) == Change::Subjects;
  });
}

settings::DaemonSettings changed(settings::DaemonSettings settings, Change change) {
  if (change == Change::Label) settings.label.search_every *= 2;
  if (change == Change::Alignment) settings.pipeline.align.patience += std::chrono::milliseconds(1);
  return settings;
}

}  // namespace

EpisodeRun::EpisodeRun(const Episode& episode, Stage stage, const std::filesystem::path& takes,
                       const Sabotage& sabotage)
    : episode_(episode),
      sabotage_(sabotage),
      stage_(std::move(stage)),
      cameras_(episode, stage_.rig()),
      description_(description_of(settings_of(stage_, episode))),
      daemon_(settings_of(stage_, episode), episode.utc_stamps ? "utc" : "estimated",
              {[this](const BlobFrame& frame) { takes_.keep(frame); },
               [this](Snapshot& snapshot, const auto& fit, Timestamp now) { on_set(snapshot, fit, now); }}),
      feed_(episode, description_),
      takes_(takes, description_, sabotage.take),
      now_(kStart) {
  for (std::uint32_t i = 0; i < stage_.subjects().size(); ++i) cast_.push_back(i);
}

Verdict EpisodeRun::run() {
  const auto steps = static_cast<std::uint64_t>(episode_.seconds * episode_.rate_hz);
  for (std::uint64_t i = 0; i < steps && !failure_; ++i) step_world();
  if (!failure_) {
    play_until(now_ + kAfterEnd);
    daemon_.finish(now_);
    feed_.send(seconds(now_));
    takes_.finish(now_);
    check_parts();
    note("images are counted", images_are_counted(daemon_.counts(), stage_.rig().size(), true));
  }
  Verdict verdict{failure_, feed_.hash(), sets_};
  return verdict;
}

void EpisodeRun::step_world() {
  stage_.step();
  truths_.push_back(stage_.truth());
  if (truths_.size() > kKeptTruths) truths_.pop_front();
  cameras_.expose(stage_.frames(), stage_.t_s());
  const double period_s = 1.0 / episode_.rate_hz;
  follow_faults(stage_.t_s(), stage_.t_s() + period_s);
  play_until(kStart + from_s(stage_.t_s() + period_s));
  takes_.work(now_);
  check_parts();
}

double EpisodeRun::seconds(Timestamp at) const { return to_s(at - kStart); }

bool EpisodeRun::is_stalled(Timestamp at) const {
  return active_fault(episode_.faults, FaultKind::HostStalls, 0, seconds(at)) != nullptr;
}

// Handles images and the ends of the patience in the order of time.
void EpisodeRun::play_until(Timestamp until) {
  while (!failure_ && !is_stalled(until)) {
    const auto due = daemon_.due();
    const Timestamp next_due = due ? std::max(*due, now_) : until;
    if (const auto arrival = cameras_.next(std::min(until, std::max(next_due, now_)))) {
      handle(*arrival);
    } else if (due && next_due < until) {
      now_ = next_due;
      daemon_.work(now_);
      if (daemon_.due() == due) break;
    } else {
      break;
    }
  }
  now_ = std::max(now_, until);
  if (!is_stalled(until)) daemon_.work(now_);
}

// A host that wakes from a stall finds all images that came meanwhile.
void EpisodeRun::handle(const Arrival& arrival) {
  now_ = std::max(now_, arrival.received);
  daemon_.receive(arrival, now_);
  while (const auto also = cameras_.next(now_)) daemon_.receive(*also, now_);
  daemon_.work(now_);
}

void EpisodeRun::follow_faults(double from_s, double to_s) {
  for (const Fault& fault : episode_.faults) {
    if (fault.from_s >= from_s && fault.from_s < to_s) begin(fault);
    if (fault.to_s() >= from_s && fault.to_s() < to_s) end(fault);
  }
}

void EpisodeRun::begin(const Fault& fault) {
  switch (fault.kind) {
    case FaultKind::Unplugged: return daemon_.lose(CameraId{fault.target});
    case FaultKind::TakeRecorded: return takes_.order(TakeAction::Start, from_s(fault.amount), now_);
    case FaultKind::TakeNext: return takes_.order(TakeAction::Next, {}, now_);
    case FaultKind::TakeCancelled: return takes_.order(TakeAction::Cancel, {}, now_);
    case FaultKind::TakeCut: return takes_.cut(fault.amount);
    case FaultKind::DiskFull: return takes_.fill_disk(fault.amount);
    case FaultKind::FolderGone: return takes_.remove_folder();
    case FaultKind::Reload: return reload(fault.amount);
    case FaultKind::SubjectReset: return order(fault.target, [this](SubjectId id) { daemon_.reset(id); });
    case FaultKind::SubjectRemoved: return order(fault.target, [this](SubjectId id) { daemon_.set_away(id, true); });
    default: return;
  }
}

void EpisodeRun::end(const Fault& fault) {
  if (fault.kind == FaultKind::TakeRecorded) takes_.order(TakeAction::Stop, {}, now_);
  if (fault.kind == FaultKind::DiskFull) takes_.free_disk();
  if (fault.kind == FaultKind::SubjectRemoved)
    order(fault.target, [this](SubjectId id) { daemon_.set_away(id, false); });
}

// An operator's order about the subject that a performer plays, if there is one.
void EpisodeRun::order(std::uint32_t performer, const std::function<void(SubjectId)>& give) {
  const auto subject = std::ranges::find(cast_, performer);
  if (subject != cast_.end()) give(SubjectId{static_cast<std::uint32_t>(subject - cast_.begin())});
}

void EpisodeRun::reload(double amount) {
  const Change change = change_of(amount);
  settings::DaemonSettings next = changed(daemon_.settings(), change);
  const std::vector<Subject> performers = stage_.subjects();
  const std::vector<std::uint32_t> before =
      std::exchange(cast_, cast_of(change, cast_, static_cast<std::uint32_t>(performers.size())));
  next.subject_models.clear();
  for (const std::uint32_t performer : cast_) next.subject_models.push_back(performers[performer]);
  const Handover handover = handover_of(before, cast_, next.rig.size());
  description_ = description_of_reload(next, handover);
  feed_.send(seconds(now_));
  daemon_.reload(std::move(next), handover);
  feed_.change(description_);
  takes_.describe(description_, now_);
}

// As Pipeline::describe_next.
Description EpisodeRun::description_of_reload(const settings::DaemonSettings& next, const Handover& handover) const {
  Description in_force = description_;
  for (const SubjectFit& fit : daemon_.fusion().fits()) in_force = with_fit(std::move(in_force), fit);
  Description description = description_of(next);
  description.version = daemon_.fusion().description_version() + 1;
  for (std::size_t i = 0; i < description.subjects.size(); ++i) {
    const SubjectId before = handover.subjects[i];
    if (before.names_something()) description.subjects[i] = in_force.subjects[before.value];
  }
  return description;
}

void EpisodeRun::on_set(Snapshot& snapshot, const std::optional<SubjectFit>& fit, Timestamp now) {
  if (failure_) return;
  ++sets_;
  if (sabotage_.snapshot) sabotage_.snapshot(snapshot);
  check(snapshot);
  check_recovery(snapshot);
  if (fit) takes_.learn(*fit);
  takes_.keep(snapshot);
  feed_.push(snapshot, fit);
  last_ = snapshot;
  const double t_s = seconds(now);
  if (active_fault(episode_.faults, FaultKind::PublisherStalls, 0, t_s) == nullptr) feed_.send(t_s);
}

void EpisodeRun::note(const std::string& invariant, const Finding& finding) {
  if (finding && !failure_) failure_ = Failure{invariant, *finding, seconds(now_), sets_};
}

void EpisodeRun::check(const Snapshot& snapshot) {
  note("all numbers are finite", all_numbers_finite(snapshot));
  if (last_) note("time goes on", time_goes_on(*last_, snapshot));
  note("labels are unique", labels_are_unique(snapshot));
  note("a snapshot survives the wire", snapshot_survives_wire(snapshot));
}

void EpisodeRun::check_parts() {
  note("images are counted", images_are_counted(daemon_.counts(), stage_.rig().size(), false));
  note("memory is bounded", memory_is_bounded(daemon_.step_growth_bytes()));
  note("the subscriber can read the feed", feed_.finding());
  note("a take is open or whole", takes_.finding());
}

void EpisodeRun::check_recovery(const Snapshot& snapshot) {
  const double t_s = seconds(snapshot.instants.exposed_at);
  if (t_s < end_of_faults_s(episode_) + kRecovery_s || t_s > episode_.seconds) return;
  const auto nearest = std::ranges::min_element(truths_, {}, [&](const scoring::EvalFrame& truth) {
    return std::abs((truth.exposed_at - snapshot.instants.exposed_at).count());
  });
  for (std::uint32_t subject = 0; subject < cast_.size(); ++subject) {
    if (needs_pose(episode_, cast_[subject])) continue;
    note("skeletons are right again", skeleton_is_right(snapshot, *nearest, subject, cast_[subject]));
  }
}

}  // namespace mocap::chaos
