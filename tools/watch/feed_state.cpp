#include "watch/feed_state.h"

#include <fmt/core.h>

#include <algorithm>

#include "wire/codec/decode.h"
#include "wire/zmq_publisher.h"

namespace mocap::watch {
namespace {

constexpr Duration kRateWindow = std::chrono::seconds(2);
constexpr std::size_t kAges = 20000;  // more than a minute at 240 Hz

LastSnapshot facts_of(const Snapshot& snapshot) {
  LastSnapshot facts;
  facts.number = snapshot.number;
  facts.exposed_at = snapshot.instants.exposed_at;
  facts.views = static_cast<std::uint32_t>(snapshot.views.size());
  facts.expected_views = snapshot.expected_views;
  facts.unlabelled = static_cast<std::uint32_t>(snapshot.unlabelled.size());
  for (const SubjectLabels& labels : snapshot.labels) {
    facts.phases.push_back(labels.phase);
    facts.labels += static_cast<std::uint32_t>(labels.markers.size());
    for (const LabelledMarker& marker : labels.markers) {
      facts.labelled += marker.state == LabelState::Lost ? 0 : 1;
      facts.measured += marker.state == LabelState::Measured ? 1 : 0;
    }
  }
  return facts;
}

}  // namespace

const v1::Snapshot* FeedState::take(const wire::FeedMessage& message, Timestamp now) {
  readable_ = false;
  if (message.topic == wire::kSnapshotTopic) take_snapshot(message.payload, now);
  if (message.topic == wire::kDescriptionTopic) take_description(message.payload);
  if (message.topic == wire::kHealthTopic) take_health(message.payload);
  return readable_ ? &message_ : nullptr;
}

void FeedState::take_snapshot(const std::string& payload, Timestamp now) {
  if (!message_.ParseFromString(payload)) return note_fault("a snapshot is not a valid Protobuf message");
  const Result<Snapshot> snapshot = wire::decode(message_);
  if (!snapshot) return note_fault(snapshot.error().message);
  readable_ = true;
  count_numbers(message_);
  last_ = facts_of(*snapshot);
  last_arrival_ = now;
  ++frames_;
  labelled_ += last_->labelled;
  labels_expected_ += last_->labels;
  if (last_->expected_views > 0 && last_->views >= last_->expected_views) ++complete_;
  if (std::find(last_->phases.begin(), last_->phases.end(), SubjectPhase::Tracking) != last_->phases.end()) ++tracking_;

  arrivals_.push_back(now);
  arrivals_.erase(arrivals_.begin(), std::find_if(arrivals_.begin(), arrivals_.end(),
                                                  [&](Timestamp at) { return now - at <= kRateWindow; }));
  // The age is computed in UTC, so that it is valid on another machine with a synchronised clock. On the daemon's
  // machine the offset of the clock cancels.
  if (!message_.has_utc_minus_host_ns()) return;
  const Duration age = now + utc_minus_host() - (last_->exposed_at + Duration(message_.utc_minus_host_ns()));
  if (ages_.size() < kAges) {
    ages_.push_back(age);
  } else {
    ages_[next_age_++ % kAges] = age;
  }
}

void FeedState::count_numbers(const v1::Snapshot& message) {
  // A take has no sequence numbers: there each missing set is a lost one.
  const std::uint64_t sequence = message.has_sequence() ? message.sequence() : message.number();
  if (frames_ > 0) {
    if (sequence <= last_sequence_) {
      ++restarts_;
    } else {
      lost_ += sequence - last_sequence_ - 1;
      const std::uint64_t sets = message.number() - last_number_;
      const std::uint64_t sent = sequence - last_sequence_;
      if (message.number() > last_number_ && sets > sent) passed_over_ += sets - sent;
    }
  }
  last_sequence_ = sequence;
  last_number_ = message.number();
}

void FeedState::take_description(const std::string& payload) {
  v1::Description message;
  if (!message.ParseFromString(payload)) return note_fault("a description is not a valid Protobuf message");
  Result<Description> read = wire::decode(message);
  if (!read) return note_fault(read.error().message);
  description_ = std::move(*read);
}

void FeedState::take_health(const std::string& payload) {
  v1::Health message;
  if (!message.ParseFromString(payload)) return note_fault("a health report is not a valid Protobuf message");
  Result<Health> read = wire::decode(message);
  if (!read) return note_fault(read.error().message);
  // After a restart of the daemon the counts start again, so a difference is meaningless.
  const bool same_run = health_ && health_->at < read->at && health_->cameras.size() == read->cameras.size();
  health_before_ = same_run ? std::move(health_) : std::nullopt;
  health_ = std::move(*read);
}

void FeedState::note_fault(const std::string& what) {
  ++unreadable_;
  last_fault_ = what;
}

double FeedState::rate_hz(Timestamp now) const {
  const auto first =
      std::find_if(arrivals_.begin(), arrivals_.end(), [&](Timestamp at) { return now - at <= kRateWindow; });
  const auto count = std::distance(first, arrivals_.end());
  if (count < 2) return 0.0;
  // Divide by the time until now, so that the rate decreases if no more snapshots arrive.
  return static_cast<double>(count - 1) / std::max(to_s(now - *first), 1e-3);
}

std::optional<Duration> FeedState::age(double p) const {
  if (ages_.empty()) return std::nullopt;
  std::vector<Duration> sorted = ages_;
  const auto at = static_cast<std::ptrdiff_t>(p * static_cast<double>(sorted.size() - 1) + 0.5);
  std::nth_element(sorted.begin(), sorted.begin() + at, sorted.end());
  return sorted[static_cast<std::size_t>(at)];
}

}  // namespace mocap::watch
