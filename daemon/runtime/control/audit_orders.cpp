#include "runtime/control/audit_orders.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "model/search_health.h"

namespace mocap::runtime {
namespace {

const char* words_of(TakeAction action) {
  switch (action) {
    case TakeAction::Start: return "take start";
    case TakeAction::Stop: return "take stop";
    case TakeAction::Cancel: return "take cancel";
    case TakeAction::Mark: return "take mark";
    case TakeAction::Next: return "take next";
    case TakeAction::ListShots: return "shots list";
    case TakeAction::ImportShots: return "shots import";
    case TakeAction::ClearShots: return "shots clear";
  }
  return "take";
}

const char* words_of(CalibrationAction action) {
  switch (action) {
    case CalibrationAction::Look: return "calibrate status";
    case CalibrationAction::List: return "calibrate list";
    case CalibrationAction::Wand: return "calibrate wand";
    case CalibrationAction::Solve: return "calibrate solve";
    case CalibrationAction::Apply: return "calibrate apply";
    case CalibrationAction::Cancel: return "calibrate cancel";
    case CalibrationAction::Restore: return "calibrate restore";
    case CalibrationAction::Floor: return "calibrate floor";
  }
  return "calibrate";
}

const char* words_of(const ControlRequest& order) {
  switch (order.action) {
    case ControlAction::StartCapture: return "capture start";
    case ControlAction::StopCapture: return "capture stop";
    case ControlAction::AddSubject: return "subject add";
    case ControlAction::RemoveSubject: return "subject remove";
    case ControlAction::ResetSubject: return "subject reset";
    case ControlAction::FitSubject: return "subject fit";
    case ControlAction::AdjustCamera: return "camera set";
    case ControlAction::LearnMask: return "mask learn";
    case ControlAction::DrawMasks: return "mask draw";
    case ControlAction::UndoMasks: return "mask undo";
    case ControlAction::ForgetMasks: return "mask forget";
    case ControlAction::Reload: return "reload";
    case ControlAction::Take: return words_of(order.take.action);
    case ControlAction::Calibrate: return words_of(order.calibration.action);
    default: return "read";
  }
}

const char* word_of(ControlCode code) {
  switch (code) {
    case ControlCode::Done: return "done";
    case ControlCode::Invalid: return "invalid";
    case ControlCode::NotFound: return "not found";
    case ControlCode::Forbidden: return "forbidden";
    case ControlCode::Unsupported: return "unsupported";
    case ControlCode::Timeout: return "timeout";
    case ControlCode::Failed: break;
  }
  return "failed";
}

const char* what_of(TakeState state) {
  switch (state) {
    case TakeState::Recording: return "recorded";
    case TakeState::Ended: return "retained";
    case TakeState::Cancelled: return "discarded";
    default: return "failed";
  }
}

// Leaves out what the order does not set.
void add_values(const TakeOrder& take, AuditEntry& entry) {
  entry.details.emplace_back("take", take.name);
  entry.details.emplace_back("slate", take.slate);
  entry.details.emplace_back("text", take.text);
  if (!take.shots.empty()) entry.details.emplace_back("shots", std::to_string(take.shots.size()));
}

}  // namespace

AuditEntry entry_of(const ControlRequest& order, const ControlAnswer& answer) {
  AuditEntry entry{.what = "ordered", .who = order.by, .details = {{"order", words_of(order)}}};
  entry.details.emplace_back("name", order.name.empty() ? order.calibration.name : order.name);
  entry.details.emplace_back("marker_set", order.marker_set);
  if (!order.marker_set_text.empty())
    entry.details.emplace_back("marker_set_bytes", std::to_string(order.marker_set_text.size()));
  if (order.exposure_us) entry.details.emplace_back("exposure_us", fmt::format("{}", *order.exposure_us));
  if (order.gain_db) entry.details.emplace_back("gain_db", fmt::format("{}", *order.gain_db));
  if (order.action == ControlAction::DrawMasks)
    entry.details.emplace_back("polygons", std::to_string(order.polygons.size()));
  if (order.images > 0) entry.details.emplace_back("images", std::to_string(order.images));
  if (order.action == ControlAction::Take) add_values(order.take, entry);
  entry.details.emplace_back("outcome", word_of(answer.code));
  entry.details.emplace_back("answer", answer.message);
  return entry;
}

AuditEntry entry_of(const TakeOrder& order) {
  AuditEntry entry{.what = "ordered", .who = order.by, .details = {{"order", words_of(order.action)}}};
  add_values(order, entry);
  return entry;
}

AuditEntry entry_of(const TakeHealth& take, const AuditActor& who) {
  AuditEntry entry{.what = what_of(take.state), .who = who};
  entry.details.emplace_back("take", text_of(take.name));
  entry.details.emplace_back("path", text_of(take.path));
  if (take.state == TakeState::Recording) return entry;
  if (take.size_bytes > 0) {
    entry.details.emplace_back("seconds", fmt::format("{:.2f}", take.seconds));
    entry.details.emplace_back("size_bytes", std::to_string(take.size_bytes));
  }
  entry.details.emplace_back("reason", text_of(take.message));
  return entry;
}

}  // namespace mocap::runtime
