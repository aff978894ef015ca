#include "take/recorder/open_take.h"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "take/recorder/lead_in.h"

namespace mocap::take {
namespace {

TakeInfo info_of(const TakeOrder& order, const std::string& slate, const TakeFolder& folder, const TakeIntake& intake) {
  TakeInfo info;
  info.producer = intake.description_at(Timestamp::max()).producer;
  info.utc_minus_host = utc_minus_host();
  info.notes = plain_text(order.text);
  info.slate = !order.slate.empty() ? order.slate : slate;
  note_first_set(intake, info);
  const TakeName name = folder.name_for(order, info.slate, host_now().time_since_epoch() + info.utc_minus_host);
  info.name = name.name;
  info.number = name.number;
  return info;
}

}  // namespace

void note_first_set(const TakeIntake& intake, TakeInfo& info) {
  if (const auto first = intake.first_set()) info.others[kFirstSetOfRun] = std::to_string(*first);
}

Result<TakeInProgress> open_take(const TakeOrder& order, Timestamp at, const std::string& slate,
                                 const TakesSettings& settings, const TakeFolder& folder, TakeIntake& intake) {
  if (const Status valid = folder.check_order(order); !valid) return valid.error();
  if (const Status ready = folder.prepare(); !ready) return ready.error();

  TakeStart begin;
  begin.info = info_of(order, slate, folder, intake);
  Timestamp from = at - order.before;
  const std::optional<Timestamp> oldest = intake.buffer().hold(from - kLongestLead);
  // The first sets of the run may still be on their way.
  from = std::max(from, std::min(oldest.value_or(at), at) - kLongestSet);
  begin.info.started_at = from;
  begin.description = intake.description_at(from);
  begin.files = intake.files();
  Result<std::unique_ptr<TakeWriter>> writer = TakeWriter::create(settings.folder / (begin.info.name + ".mcap"), begin);
  if (!writer) {
    intake.buffer().release();
    return writer.error();
  }
  TakeInProgress recording(*std::move(writer), begin.info, begin.description, settings.snapshots);
  recording.from = from;
  recording.checked_at = at;
  recording.dropped_before = intake.dropped();
  if (order.length > Duration::zero()) recording.to = at + order.length;
  return recording;
}

}  // namespace mocap::take
