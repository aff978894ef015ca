#include "take/recorder/waiting_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace mocap::take {
namespace {

// A take that waits for a timecode starts also if the timecode passed so recently: a source that starts at this
// timecode is known only 0.3 s later.
constexpr Duration kJustPassed = std::chrono::milliseconds(900);

}  // namespace

Duration wait_of(const TakeOrder& order, Timestamp now) {
  if (order.at_utc_ns == 0) return order.countdown;
  return Duration{order.at_utc_ns} - now.time_since_epoch() - utc_minus_host();
}

Status WaitingStart::check(const TakeOrder& order) const {
  if (!order.at_timecode) return {};
  const Result<Timecode> wanted = timecode_for(order);
  return wanted ? Status{} : Status{wanted.error()};
}

Result<std::string> WaitingStart::begin(const TakeOrder& order, Timestamp now) {
  if (!order.at_timecode) {
    const Duration wait = wait_of(order, now);
    order_ = order;
    due_at_ = now + wait;
    return fmt::format("the take starts in {:.1f} s", to_s(wait));
  }
  const Result<Timecode> wanted = timecode_for(order);
  if (!wanted) return wanted.error();
  order_ = order;
  order_->at_timecode = *wanted;
  due_at_ = due_by_timecode(now);
  const std::string when = due_at_ == Timestamp::max() ? std::string(text_of(timecode_.sentence))
                                                       : fmt::format("in {:.1f} s", std::max(0.0, to_s(due_at_ - now)));
  return fmt::format("the take starts at {}; {}", text_of(*wanted), when);
}

// The timecode of the order, in the format of the source.
Result<Timecode> WaitingStart::timecode_for(const TakeOrder& order) const {
  if (timecode_.source == TimecodeSourceKind::None) {
    return Error{
        ErrorCode::InvalidArgument,
        "the take cannot start at a timecode: [timecode] source is \"none\"; give a time (UTC) or set a source"};
  }
  Timecode wanted = timecode_of(0, timecode_.format);
  wanted.hours = order.at_timecode->hours;
  wanted.minutes = order.at_timecode->minutes;
  wanted.seconds = order.at_timecode->seconds;
  wanted.frames = order.at_timecode->frames;
  if (is_valid(wanted)) return wanted;
  return Error{ErrorCode::InvalidArgument,
               fmt::format("{} does not exist at {} frames per second{}", text_of(wanted), wanted.frames_per_second,
                           wanted.drop_frame ? ", drop-frame" : "")};
}

void WaitingStart::set_timecode(const TimecodeHealth& timecode, Timestamp now) {
  timecode_ = timecode;
  if (order_ && order_->at_timecode && now < due_at_) due_at_ = due_by_timecode(now);
}

// Never while there is no timecode.
Timestamp WaitingStart::due_by_timecode(Timestamp now) const {
  if (!timecode_.clock || now > timecode_.clock->valid_until) return Timestamp::max();
  return time_of(*timecode_.clock, *order_->at_timecode, now - kJustPassed);
}

std::optional<WaitingStart::Due> WaitingStart::take_due(Timestamp now) {
  if (!order_ || now < due_at_) return std::nullopt;
  return Due{*std::exchange(order_, std::nullopt), due_at_};
}

bool WaitingStart::cancel() { return std::exchange(order_, std::nullopt).has_value(); }

}  // namespace mocap::take
