#include "watch/take_player.h"

#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <thread>
#include <utility>

#include "wire/zmq_publisher.h"

namespace mocap::watch {
namespace {

using take::TakeTopic;

// The age of recorded data has no meaning, so the message loses the clock by which a feed's age is measured.
std::string without_clock(std::string_view bytes) {
  v1::Snapshot message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::string(bytes);
  message.clear_utc_minus_host_ns();
  return message.SerializeAsString();
}

wire::FeedMessage message_of(const take::TakeRecord& record, PlayPace pace) {
  switch (record.topic) {
    case TakeTopic::Description: return {wire::kDescriptionTopic, std::string(record.bytes)};
    case TakeTopic::Snapshot:
      return {wire::kSnapshotTopic,
              pace == PlayPace::Recorded ? without_clock(record.bytes) : std::string(record.bytes)};
    default: return {wire::kHealthTopic, std::string(record.bytes)};
  }
}

}  // namespace

TakePlayer::TakePlayer(std::unique_ptr<take::TakeReader> take, PlayPace pace)
    : take_(std::move(take)),
      cursor_(take_->messages({.topics = {TakeTopic::Description, TakeTopic::Snapshot, TakeTopic::Health}})),
      pace_(pace) {}

Result<TakePlayer> TakePlayer::open(const std::filesystem::path& take, PlayPace pace) {
  Result<take::TakeReader> opened = take::TakeReader::open(take);
  if (!opened) return opened.error();
  return TakePlayer(std::make_unique<take::TakeReader>(*std::move(opened)), pace);
}

Result<wire::FeedMessage> TakePlayer::next(Duration patience) {
  if (const auto& damages = take_->mcap().damages(); named_damages_ < damages.size()) {
    const std::string& what = damages[named_damages_++].what;
    return Error{ErrorCode::InvalidArgument, fmt::format("'{}', {}", take_->mcap().path(), what)};
  }
  if (!coming_) {
    const Result<std::optional<take::TakeRecord>> record = cursor_.next();
    if (!record) return record.error();
    if (!*record) return Error{ErrorCode::EndOfStream, "the take has ended"};
    coming_ = **record;  // its bytes are valid until the cursor moves
  }
  if (!wait_until_due(coming_->at, patience)) return Error{ErrorCode::Timeout, {}};
  const take::TakeRecord record = *std::exchange(coming_, std::nullopt);
  return message_of(record, pace_);
}

bool TakePlayer::wait_until_due(Timestamp at, Duration patience) {
  if (pace_ == PlayPace::AtOnce) return true;
  const Timestamp now = host_now();
  if (!started_at_) {
    started_at_ = now;
    first_at_ = at;
  }
  const Timestamp due = *started_at_ + (at - first_at_);
  std::this_thread::sleep_until(std::min(due, now + patience));
  return due <= now + patience;
}

}  // namespace mocap::watch
