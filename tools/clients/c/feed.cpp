#include "feed.h"

#include <algorithm>

#include "decode.h"
#include "text.h"

namespace mocap::client {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
constexpr std::int64_t kRateWindow_ns = 2 * kSecond_ns;
// Longest transit time of a message on the same machine. A longer time means a tunnel to another machine with another
// clock.
constexpr std::int64_t kMaxLocalTransit_ns = 60 * kSecond_ns;
// At a Windows machine's own address the daemon runs in a virtual machine, with another monotonic clock.
#ifdef _WIN32
constexpr bool kDaemonRunsHere = false;
#else
constexpr bool kDaemonRunsHere = true;
#endif
constexpr std::string_view kDescriptionTopic = "description";
constexpr std::string_view kHealthTopic = "health";
constexpr std::string_view kEventTopic = "event";
constexpr std::size_t kMaxEvents = 256;  // the newest, for a caller that takes none
constexpr const char* kProtocol = "mocap.v1";

bool starts_with(std::string_view text, std::string_view with) { return text.substr(0, with.size()) == with; }

bool same_clock(bool local, const mocap_frame_info& info, Now now) {
  if (!local || info.sent_at_ns == MOCAP_ABSENT) return false;
  const std::int64_t transit_ns = now.host_ns - info.sent_at_ns;
  return transit_ns > -kSecond_ns / 1000 && transit_ns < kMaxLocalTransit_ns;
}

}  // namespace

bool is_local(std::string_view endpoint) {
  if (!kDaemonRunsHere) return false;
  for (const std::string_view at : {"ipc://", "inproc://", "tcp://127.", "tcp://localhost:", "tcp://[::1]:"}) {
    if (starts_with(endpoint, at)) return true;
  }
  return false;
}

std::int64_t age_of(const Frame& frame, Now now) {
  if (frame.serial == 0 || frame.info.exposed_at_ns == MOCAP_ABSENT) return MOCAP_ABSENT;
  if (frame.same_clock) return now.host_ns - frame.info.exposed_at_ns;
  if (frame.info.utc_minus_host_ns == MOCAP_ABSENT) return MOCAP_ABSENT;
  return now.utc_ns - (frame.info.exposed_at_ns + frame.info.utc_minus_host_ns);
}

Feed::Feed(const FeedSettings& settings)
    : settings_(settings),
      prefix_(settings.topic),
      axes_(settings.axes),
      local_(is_local(settings.endpoint)),
      ring_(std::max<std::size_t>(settings.keep, 1)) {
  prefix_.push_back('\0');
  counts_.age_ns = counts_.age_p50_ns = counts_.age_p99_ns = MOCAP_ABSENT;
}

void Feed::take(std::string_view message, Now now) {
  counts_.bytes += message.size();
  const auto end = message.find('\0');
  const std::string_view topic = message.substr(0, end);
  if (end == std::string_view::npos) {
    ++counts_.unreadable;
    last_fault_ = "a message without a topic";
    return;
  }
  const std::string_view bytes = message.substr(end + 1);
  if (topic == kDescriptionTopic) return take_description(bytes);
  if (topic == kHealthTopic) return take_health(bytes);
  if (topic == kEventTopic) return take_event(bytes);
  if (topic == settings_.topic) take_snapshot(bytes, now);
}

void Feed::take_description(std::string_view bytes) {
  auto read = std::make_shared<Description>();
  const char* fault = decode_description(bytes, *read);
  // In an unknown protocol only the field with its name is reliable.
  if (fault == nullptr && read->protocol != kProtocol) {
    foreign_protocol_ = read->protocol.empty() ? "without a name" : read->protocol.substr(0, 40);
    description_ = nullptr;
    return;
  }
  if (fault != nullptr) {
    ++counts_.unreadable;
    last_fault_ = fault;
    return;
  }
  foreign_protocol_.clear();
  // The daemon repeats an unchanged description once a second.
  if (description_ && description_->version == read->version && description_->session == read->session) return;
  if (description_ && description_->session != read->session) {
    ++counts_.restarts;
    counted_ = false;
  }
  for (SubjectDescription& subject : read->subjects) {
    for (mocap_bone& bone : subject.bones) bone.rest_offset = axes_.place(bone.rest_offset);
    for (mocap_marker& marker : subject.markers) marker.offset = axes_.place(marker.offset);
  }
  description_ = std::move(read);
}

void Feed::take_health(std::string_view bytes) {
  auto read = std::make_shared<Health>();
  const char* fault = decode_health(bytes, *read);
  if (fault == nullptr) {
    health_ = std::move(read);
    return;
  }
  ++counts_.unreadable;
  last_fault_ = fault;
}

void Feed::take_event(std::string_view bytes) {
  Event read;
  if (const char* fault = decode_event(bytes, read); fault != nullptr) {
    ++counts_.unreadable;
    last_fault_ = fault;
    return;
  }
  if (description_ && read.subject && *read.subject < description_->subjects.size())
    copy_text(read.event.name, sizeof(read.event.name), description_->subjects[*read.subject].name);
  if (description_ && read.camera && *read.camera < description_->cameras.size())
    copy_text(read.event.name, sizeof(read.event.name), description_->cameras[*read.camera]);
  if (events_.size() == kMaxEvents) events_.pop_front();
  events_.push_back(read.event);
}

bool Feed::next_event(mocap_event& into) {
  if (events_.empty()) return false;
  into = events_.front();
  events_.pop_front();
  return true;
}

void Feed::take_snapshot(std::string_view bytes, Now now) {
  if (!foreign_protocol_.empty()) return;
  const char* fault = decode_snapshot(bytes, scratch_);
  if (fault == nullptr) {
    count(scratch_.info, now);
    // The indices of the snapshot refer to another description, which arrives within a second.
    if (!description_ || description_->version != scratch_.info.description_version) return;
    change_axes(scratch_);
    fault = complete(scratch_, *description_);
  }
  if (fault != nullptr) {
    ++counts_.unreadable;
    last_fault_ = fault;
    return;
  }
  last_frame_ns_ = now.host_ns;
  any_subject_ = !scratch_.subjects.empty();
  tracking_ = std::any_of(scratch_.subjects.begin(), scratch_.subjects.end(),
                          [](const SubjectFrame& subject) { return subject.phase == MOCAP_PHASE_TRACKING; });
  note_transit(scratch_.info, now);
  scratch_.client = settings_.id;
  scratch_.serial = ++serial_;
  scratch_.same_clock = same_clock(local_, scratch_.info, now);
  scratch_.description = description_;
  std::swap(scratch_, ring_[serial_ % ring_.size()]);
}

void Feed::count(const mocap_frame_info& info, Now now) {
  if (counted_ && info.sequence >= next_sequence_) counts_.lost += info.sequence - next_sequence_;
  if (counted_ && info.sequence < next_sequence_ && description_ && description_->version == info.description_version) {
    ++counts_.restarts;  // the daemon restarted, but its new description has not arrived yet
  }
  counted_ = true;
  next_sequence_ = info.sequence + 1;
  arrivals_[counts_.received % kRates] = now.host_ns;
  ++counts_.received;
}

void Feed::change_axes(Frame& frame) const {
  if (axes_.identity()) return;
  for (SubjectFrame& subject : frame.subjects) {
    for (mocap_bone_pose& bone : subject.bones) {
      bone.position = axes_.place(bone.position);
      bone.rotation = axes_.turn(bone.rotation);
      bone.local_position = axes_.place(bone.local_position);
      bone.local_rotation = axes_.turn(bone.local_rotation);
      bone.velocity = axes_.place(bone.velocity);
      bone.spin = axes_.spin(bone.spin);
    }
    for (mocap_marker_pose& marker : subject.markers) marker.position = axes_.place(marker.position);
  }
  for (mocap_point& point : frame.points) point.position = axes_.place(point.position);
}

void Feed::note_transit(const mocap_frame_info& info, Now now) {
  if (info.sent_at_ns == MOCAP_ABSENT || info.utc_minus_host_ns == MOCAP_ABSENT) return;
  const std::int64_t transit = now.utc_ns - (info.sent_at_ns + info.utc_minus_host_ns);
  if (transit_ns_ == MOCAP_ABSENT || now.host_ns - transit_since_ns_ >= kSecond_ns) {
    transit_before_ns_ = transit_ns_;
    transit_since_ns_ = now.host_ns;
    transit_ns_ = transit;
  }
  transit_ns_ = std::min(transit_ns_, transit);
}

bool Feed::hand_out(Frame& into, Now now) {
  const std::uint64_t had = into.client == settings_.id ? into.serial : 0;
  if (serial_ == had) return false;
  const std::uint64_t oldest = serial_ < ring_.size() ? 1 : serial_ - ring_.size() + 1;
  const std::uint64_t wanted = ring_.size() == 1 ? serial_ : std::max(had + 1, oldest);
  into = ring_[wanted % ring_.size()];
  if (wanted > handed_out_ + 1 && handed_out_ > 0) counts_.skipped += wanted - handed_out_ - 1;
  handed_out_ = std::max(handed_out_, wanted);
  counts_.age_ns = age_of(into, now);
  if (counts_.age_ns != MOCAP_ABSENT) ages_[age_count_++ % kAges] = counts_.age_ns;
  return true;
}

mocap_statistics Feed::statistics(Now now) const {
  mocap_statistics all = counts_;
  all.connections = link_.connections;
  const std::size_t known = std::min<std::size_t>(counts_.received, kRates);
  std::size_t within = 0;
  std::int64_t oldest = now.host_ns;
  for (std::size_t i = 0; i < known; ++i) {
    if (now.host_ns - arrivals_[i] > kRateWindow_ns) continue;
    ++within;
    oldest = std::min(oldest, arrivals_[i]);
  }
  // Divide by the time until now, so that the rate decreases if no more snapshots arrive.
  if (within > 1 && now.host_ns > oldest) {
    all.rate_hz =
        static_cast<double>(within - 1) * static_cast<double>(kSecond_ns) / static_cast<double>(now.host_ns - oldest);
  }
  const std::size_t ages = std::min(age_count_, kAges);
  if (ages > 0) {
    std::array<std::int64_t, kAges> sorted = ages_;
    const auto at = [&](std::size_t percent) {
      const auto nth = sorted.begin() + static_cast<std::ptrdiff_t>((ages - 1) * percent / 100);
      std::nth_element(sorted.begin(), nth, sorted.begin() + static_cast<std::ptrdiff_t>(ages));
      return *nth;
    };
    all.age_p50_ns = at(50);
    all.age_p99_ns = at(99);
  }
  return all;
}

}  // namespace mocap::client
