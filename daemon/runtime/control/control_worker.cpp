#include "runtime/control/control_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "base/log.h"
#include "runtime/control/audit_orders.h"
#include "runtime/control/control_answer.h"
#include "runtime/stop_check.h"

namespace mocap::runtime {
namespace {

constexpr const char* kWho = "control";
constexpr Duration kSnapshotPatience = std::chrono::seconds(1);
constexpr Duration kMainPatience = std::chrono::seconds(5);   // the main thread reads files
constexpr Duration kOrderPatience = std::chrono::seconds(3);  // a camera restart takes up to 2 s
constexpr const char* kNoSnapshot = "no snapshot within 1 s; check that the cameras deliver images";
constexpr Duration kAuditPatience = std::chrono::seconds(1);
constexpr Duration kAnswerPollPeriod = std::chrono::milliseconds(1);

ControlAnswer done(std::string message) { return plain_answer(ControlCode::Done, std::move(message)); }

std::string text_of(const OrderDone& done) { return {done.message.begin(), done.message.end()}; }

template <class Things>
std::string names_of(const Things& things) {
  std::string all;
  for (const auto& thing : things) all += (all.empty() ? "" : ", ") + thing.name;
  return all.empty() ? "none" : all;
}

ControlAnswer not_answered(const std::string& who) {
  return plain_answer(ControlCode::Timeout,
                      fmt::format("{} did not answer in time; the request may still be executed", who));
}

}  // namespace

ControlWorker::ControlWorker(std::unique_ptr<ControlServer> server, Description description, bool lossless, Links links)
    : server_(std::move(server)),
      description_(std::move(description)),
      lossless_(lossless),
      links_(std::move(links)),
      snapshot_(std::make_unique<Snapshot>()),
      away_(description_.subjects.size(), false) {}

void ControlWorker::change(Description description, Links links) {
  receive_updates();  // the descriptions that wait are older
  std::vector<bool> away(description.subjects.size(), false);
  for (std::size_t i = 0; i < away.size(); ++i) {
    const auto same = std::ranges::find(description_.subjects, description.subjects[i].name, &Subject::name);
    if (same != description_.subjects.end())
      away[i] = away_[static_cast<std::size_t>(same - description_.subjects.begin())];
  }
  away_ = std::move(away);
  if (calibration_.state == CalibrationState::Collecting || calibration_.state == CalibrationState::Solving) {
    calibration_.state = CalibrationState::Cancelled;
    calibration_.message = "the configuration changed during the calibration; start again";
  }
  description_ = std::move(description);
  links_ = std::move(links);
}

void ControlWorker::run(const std::stop_token& stop) {
  change_follows_ = false;
  while (!stop.stop_requested() && !change_follows_) {
    receive_updates();
    answer_takes();
    continue_to_learn(stop);
    if (change_follows_) break;
    const std::optional<ControlRequest> request = server_->next(request_patience());
    if (!request) continue;
    receive_updates();
    asker_ = request->by;
    if (const std::optional<ControlAnswer> answer = begin(*request, stop)) finish(*request, *answer);
  }
  // The cameras and the recorder may be others when this thread runs again.
  stop_to_learn("the configuration changes or the daemon stops");
  give_up_takes();
}

// Returns the answer, if it is known at once.
std::optional<ControlAnswer> ControlWorker::begin(const ControlRequest& request, const std::stop_token& stop) {
  switch (request.action) {
    case ControlAction::LearnMask: return begin_to_learn(request);
    case ControlAction::GetShots:
    case ControlAction::Take: return begin_take(request);
    default: return execute(request, stop);
  }
}

void ControlWorker::finish(const ControlRequest& request, const ControlAnswer& answer) {
  if (!only_looks(request.action)) note_order(request, answer);
  server_->answer(request.number, answer);
}

// An order is in the audit log before it is answered (audit/decisions/0001). If the disk is slow, the answer waits for
// it; if it is full, the entry waits in memory.
void ControlWorker::note_order(const ControlRequest& request, const ControlAnswer& answer) {
  if (links_.audit != nullptr) static_cast<void>(links_.audit->write(entry_of(request, answer), kAuditPatience));
}

void ControlWorker::receive_updates() {
  ControlChannel& control = *links_.control;
  while (const Health* health = control.health.front()) {
    health_ = *health;
    control.health.pop();
  }
  while (const Description* description = control.descriptions.front()) {
    description_ = *description;
    control.descriptions.pop();
  }
  receive_calibration();
}

ControlAnswer ControlWorker::execute(const ControlRequest& request, const std::stop_token& stop) {
  switch (request.action) {
    case ControlAction::GetStatus: return status();
    case ControlAction::GetDescription: {
      ControlAnswer answer;
      answer.description = &description_;
      return answer;
    }
    case ControlAction::GetSnapshot: return next_snapshot(stop);
    case ControlAction::StartCapture: return capture(true, stop);
    case ControlAction::StopCapture: return capture(false, stop);
    case ControlAction::AddSubject:
    case ControlAction::RemoveSubject:
    case ControlAction::ResetSubject:
    case ControlAction::FitSubject: return order_subject(request, stop);
    case ControlAction::AdjustCamera: return adjust_camera(request, stop);
    case ControlAction::LearnMask: break;  // begin_to_learn()
    case ControlAction::DrawMasks:
    case ControlAction::UndoMasks:
    case ControlAction::ForgetMasks: return change_masks(request, stop);
    case ControlAction::GetMasks: return list_masks(request);
    case ControlAction::Reload: return order_main({}, stop);
    case ControlAction::GetShots:
    case ControlAction::Take: break;  // begin_take()
    case ControlAction::GetCalibration: return look_at_calibration(request.calibration, stop);
    case ControlAction::Calibrate: return calibrate(request.calibration, stop);
  }
  return plain_answer(ControlCode::Unsupported, "unknown request");
}

ControlAnswer ControlWorker::status() const {
  ControlAnswer answer;
  ControlStatus& status = answer.status.emplace();
  status.producer = description_.producer;
  status.session_id = description_.session_id;
  status.capturing = capturing_;
  status.health = health_;
  for (std::size_t i = 0; i < description_.subjects.size(); ++i) {
    const int phase = links_.control->phases[i].load(std::memory_order_relaxed);
    status.subjects.push_back({description_.subjects[i].name, static_cast<SubjectPhase>(phase), away_[i]});
  }
  return answer;
}

ControlAnswer ControlWorker::next_snapshot(const std::stop_token& stop) {
  ControlChannel& control = *links_.control;
  if (!capturing_)
    return plain_answer(ControlCode::Timeout, "no snapshot: capture is stopped; run mocapctl capture start");
  if (control.snapshots.front() != nullptr) {
    control.snapshots.pop();  // answers an earlier request that timed out
  } else if (host_now() < no_snapshot_until_) {
    return plain_answer(ControlCode::Timeout, kNoSnapshot);
  }
  control.snapshot_wanted.store(true, std::memory_order_release);
  const Timestamp begun = host_now();
  while (!stop.stop_requested() && host_now() - begun < kSnapshotPatience) {
    if (const Snapshot* newest = control.snapshots.front()) {
      *snapshot_ = *newest;
      control.snapshots.pop();
      ControlAnswer answer;
      answer.snapshot = snapshot_.get();
      return answer;
    }
    std::this_thread::sleep_for(kAnswerPollPeriod);
  }
  no_snapshot_until_ = host_now() + kSnapshotPatience;
  return plain_answer(ControlCode::Timeout, kNoSnapshot);
}

std::optional<OrderDone> ControlWorker::wait_for(SpscQueue<OrderDone>& answers, std::uint64_t order, Duration patience,
                                                 const std::stop_token& stop) {
  const Timestamp begun = host_now();
  OrderDone answer;
  while (!stop.stop_requested() && host_now() - begun < patience) {
    while (answers.try_pop(answer)) {
      if (answer.order == order) return answer;  // earlier answers belong to orders that timed out
    }
    std::this_thread::sleep_for(kAnswerPollPeriod);
  }
  return std::nullopt;
}

ControlAnswer ControlWorker::order_camera(std::size_t camera, CameraOrder order, const std::stop_token& stop) {
  CameraChannel& channel = *links_.cameras[camera];
  const std::string who = fmt::format("camera '{}'", description_.cameras[camera].name);
  order.number = ++orders_;
  if (!channel.orders.try_push(order)) return not_answered(who);
  const std::optional<OrderDone> answered = wait_for(channel.orders_done, order.number, kOrderPatience, stop);
  if (!answered) return not_answered(who);
  if (answered->done) return done(fmt::format("{}: {}", who, text_of(*answered)));
  return plain_answer(answered->unsupported ? ControlCode::Unsupported : ControlCode::Failed,
                      fmt::format("{}: {}", who, text_of(*answered)));
}

ControlAnswer ControlWorker::capture(bool on, const std::stop_token& stop) {
  if (lossless_)
    return plain_answer(ControlCode::Unsupported, "a replay runs to its end, it cannot be stopped and started");
  if (on == capturing_) return done(on ? "capture runs already" : "capture is stopped already");
  if (!on) stop_to_learn("the capture was stopped");
  CameraOrder order;
  order.action = on ? CameraAction::Start : CameraAction::Stop;
  std::string late;
  for (std::size_t i = 0; i < links_.cameras.size(); ++i) {
    const ControlAnswer answer = order_camera(i, order, stop);
    if (answer.code != ControlCode::Done) late += (late.empty() ? "" : "; ") + answer.message;
  }
  capturing_ = on;
  log_info(kWho, on ? "capture started" : "capture stopped");
  if (!late.empty()) return plain_answer(ControlCode::Timeout, late);
  return done(on ? "capture started" : "capture stopped");
}

ControlAnswer ControlWorker::order_subject(const ControlRequest& request, const std::stop_token& stop) {
  const auto& subjects = description_.subjects;
  const auto found = std::ranges::find(subjects, request.name, &Subject::name);
  const bool makes_one = !request.marker_set.empty() || !request.marker_set_text.empty();
  if (found == subjects.end() && makes_one) {
    MainOrder order;
    order.subject = request.name;
    order.marker_set = request.marker_set;
    order.marker_set_text = request.marker_set_text;
    return order_main(std::move(order), stop);
  }
  if (found == subjects.end()) {
    return plain_answer(
        ControlCode::NotFound,
        fmt::format("there is no subject '{}'; the daemon was configured with: {}; mocapctl subject add {} "
                    "--marker-set FILE makes a new one",
                    request.name, names_of(subjects), request.name));
  }
  if (makes_one) {
    return plain_answer(ControlCode::Invalid,
                        fmt::format("there is a subject '{}' already; add it without --marker-set to "
                                    "search for it again",
                                    request.name));
  }
  SubjectOrder order;
  order.number = ++orders_;
  order.subject = SubjectId{static_cast<std::uint32_t>(found - subjects.begin())};
  const std::size_t bones = found->marker_set.skeleton.bones.size(), markers = found->marker_set.markers.size();
  switch (request.action) {
    case ControlAction::AddSubject: order.action = SubjectAction::Add; break;
    case ControlAction::RemoveSubject: order.action = SubjectAction::Remove; break;
    case ControlAction::ResetSubject: order.action = SubjectAction::Reset; break;
    default: order.action = SubjectAction::Fit;
  }
  if (order.action == SubjectAction::Fit) {
    if (request.rest_offsets_m.size() != bones || request.marker_offsets_m.size() != markers) {
      return plain_answer(ControlCode::Invalid,
                          fmt::format("subject '{}' has {} bones and {} markers, the fit has {} and {}", request.name,
                                      bones, markers, request.rest_offsets_m.size(), request.marker_offsets_m.size()));
    }
    order.fit.subject = order.subject;
    order.fit.residual_m = request.residual_m;
    for (const auto& offset : request.rest_offsets_m) order.fit.rest_offsets_m.push_back(offset);
    for (const auto& offset : request.marker_offsets_m) order.fit.marker_offsets_m.push_back(offset);
  }
  ControlChannel& control = *links_.control;
  if (!control.to_fusion.try_push(order)) return not_answered("the fusion");
  control.wake_fusion->signal();
  const auto answered = wait_for(control.from_fusion, order.number, kOrderPatience, stop);
  if (!answered) return not_answered("the fusion");
  if (order.action == SubjectAction::Remove) away_[order.subject.value] = true;
  if (order.action == SubjectAction::Add) away_[order.subject.value] = false;
  log_info(kWho, fmt::format("subject {}: {}", request.name, text_of(*answered)));
  return done(fmt::format("subject '{}': {}", request.name, text_of(*answered)));
}

std::optional<std::size_t> ControlWorker::find_camera(const std::string& name) const {
  const auto found = std::ranges::find(description_.cameras, name, &CameraModel::name);
  if (found == description_.cameras.end()) return std::nullopt;
  return static_cast<std::size_t>(found - description_.cameras.begin());
}

ControlAnswer ControlWorker::adjust_camera(const ControlRequest& request, const std::stop_token& stop) {
  const auto camera = find_camera(request.name);
  if (!camera) {
    return plain_answer(ControlCode::NotFound,
                        fmt::format("there is no camera '{}'; the daemon was configured with: {}", request.name,
                                    names_of(description_.cameras)));
  }
  CameraOrder order;
  order.action = CameraAction::Adjust;
  order.exposure_us = request.exposure_us;
  order.gain_db = request.gain_db;
  return order_camera(*camera, order, stop);
}

ControlAnswer ControlWorker::order_main(MainOrder order, const std::stop_token& stop) {
  if (!order.list_rigs) await_takes(stop);
  ControlChannel& control = *links_.control;
  const std::uint64_t number = order.number = ++orders_;
  order.by = asker_;
  const bool lists = order.list_rigs;
  if (!control.to_main.try_push(std::move(order))) return not_answered("the daemon");
  const Timestamp begun = host_now();
  MainDone answer;
  // The main thread may stop this thread right after its answer, so the queue is read once more after a stop request.
  for (bool ends = false; !ends;) {
    ends = stop.stop_requested() || host_now() - begun >= kMainPatience;
    while (control.from_main.try_pop(answer)) {
      if (answer.order != number) continue;
      change_follows_ = answer.change_follows;
      ControlAnswer executed = plain_answer(answer.done ? ControlCode::Done : ControlCode::Invalid, answer.message);
      if (lists) executed.rigs = std::move(answer.rigs);
      return executed;
    }
    std::this_thread::sleep_for(kAnswerPollPeriod);
  }
  return not_answered("the daemon");
}

}  // namespace mocap::runtime
