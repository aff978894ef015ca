#include "take/take_reader.h"

#include <fmt/core.h>

#include <algorithm>
#include <limits>

#include "mocap/v1/health.pb.h"
#include "take/take_writer.h"
#include "wire/codec/camera_blobs.h"
#include "wire/codec/decode.h"

namespace mocap::take {
namespace {

TakeTopic topic_of(std::string_view name) {
  if (name == kDescriptionTopic) return TakeTopic::Description;
  if (name == kSnapshotTopic) return TakeTopic::Snapshot;
  if (name == kHealthTopic) return TakeTopic::Health;
  if (name == kEventTopic) return TakeTopic::Event;
  return name.starts_with(kBlobsTopics) ? TakeTopic::Blobs : TakeTopic::Other;
}

std::map<std::uint16_t, TakeTopic> topics_of(const mcap::Summary& summary, const TakeSelection& selection) {
  std::map<std::uint16_t, TakeTopic> topics;
  for (const auto& [id, channel] : summary.channels) {
    const TakeTopic topic = topic_of(channel.topic);
    const bool other_camera = topic == TakeTopic::Blobs && !selection.camera.empty() &&
                              channel.topic != std::string(kBlobsTopics) + selection.camera;
    if (other_camera) continue;
    if (selection.topics.empty() || selection.topics.contains(topic)) topics[id] = topic;
  }
  return topics;
}

// Stands for a selection without channels, because an empty set selects all. The cursor skips the messages of a file
// that has a channel of this id.
constexpr std::uint16_t kNoChannel = 0xFFFF;

std::set<std::uint16_t> channels_of(const std::map<std::uint16_t, TakeTopic>& topics) {
  std::set<std::uint16_t> channels{kNoChannel};
  for (const auto& [id, topic] : topics) channels.insert(id);
  return channels;
}

template <class Message>
Result<Message> parse(const TakeRecord& record, const char* what) {
  Message message;
  if (!message.ParseFromArray(record.bytes.data(), static_cast<int>(record.bytes.size()))) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("the {} at {} ns is no valid message", what, to_ns(record.at))};
  }
  return message;
}

template <class Message>
auto parse_and_decode(const TakeRecord& record, const char* what) -> decltype(wire::decode(Message())) {
  const Result<Message> message = parse<Message>(record, what);
  if (!message) return message.error();
  return wire::decode(*message);
}

}  // namespace

Result<Description> description_of(const TakeRecord& record) {
  return parse_and_decode<v1::Description>(record, "description");
}

Result<Snapshot> snapshot_of(const TakeRecord& record) { return parse_and_decode<v1::Snapshot>(record, "snapshot"); }

Result<v1::Snapshot> snapshot_message_of(const TakeRecord& record) { return parse<v1::Snapshot>(record, "snapshot"); }

Result<Health> health_of(const TakeRecord& record) { return parse_and_decode<v1::Health>(record, "health"); }

Result<v1::Event> event_of(const TakeRecord& record) { return parse<v1::Event>(record, "event"); }

Result<BlobFrame> blobs_of(const TakeRecord& record) {
  const Result<v1::CameraBlobs> message = parse<v1::CameraBlobs>(record, "image of blobs");
  if (!message) return message.error();
  return wire::decode(*message);
}

Result<TakeReader> TakeReader::open(const std::filesystem::path& path) {
  Result<mcap::Reader> mcap = mcap::Reader::open(path);
  if (!mcap) return mcap.error();
  TakeReader reader(*std::move(mcap));
  if (const Status read = reader.read_info(); !read) {
    return Error{read.error().code, fmt::format("'{}': {}", path.string(), read.error().message)};
  }
  return reader;
}

// Reads the last metadata record of the name kTakeMetadata.
Status TakeReader::read_info() {
  const std::vector<mcap::MetadataIndex>& all = mcap_.summary().metadata;
  const auto last = std::find_if(all.rbegin(), all.rend(), [](const auto& one) { return one.name == kTakeMetadata; });
  if (last == all.rend()) {
    if (mcap_.cut_off() && mcap_.summary().chunks.empty()) {
      return Error{ErrorCode::InvalidArgument,
                   is_being_written()
                       ? "the recording begins just now; try again"
                       : "the recording was cut off at its beginning, before the first set; delete the file"};
    }
    return Error{ErrorCode::InvalidArgument,
                 "no take: it has no metadata 'take'; expected an MCAP file that mocapd recorded"};
  }
  const Result<mcap::Metadata> metadata = mcap_.metadata(*last);
  if (!metadata) return metadata.error();
  Result<TakeInfo> info = decode_info(*metadata);
  if (!info) return info.error();
  info_ = *std::move(info);
  return {};
}

Timestamp TakeReader::host_time_of(std::uint64_t utc_ns) const {
  // Times beyond the range of a Timestamp are damage; the subtraction must not overflow.
  constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max() / 2);
  return from_ns(static_cast<std::int64_t>(std::min(utc_ns, kLatest))) - info_.utc_minus_host;
}

// 0: no time, or one that UTC cannot express in nanoseconds.
std::uint64_t TakeReader::utc_of(const std::optional<Timestamp>& at) const {
  std::int64_t utc_ns = 0;
  if (!at || __builtin_add_overflow(to_ns(*at), info_.utc_minus_host.count(), &utc_ns)) return 0;
  return static_cast<std::uint64_t>(std::max<std::int64_t>(utc_ns, 0));
}

std::map<std::string, std::uint64_t> TakeReader::counts() const {
  std::map<std::string, std::uint64_t> counts;
  for (const auto& [id, channel] : mcap_.summary().channels) {
    const auto found = mcap_.summary().statistics.channel_messages.find(id);
    counts[channel.topic] += found == mcap_.summary().statistics.channel_messages.end() ? 0 : found->second;
  }
  return counts;
}

Timestamp TakeReader::first_at() const { return host_time_of(mcap_.summary().statistics.start_time_ns); }

Timestamp TakeReader::last_at() const { return host_time_of(mcap_.summary().statistics.end_time_ns); }

std::vector<std::string> TakeReader::files() const {
  std::vector<std::string> names;
  for (const mcap::AttachmentIndex& one : mcap_.summary().attachments) names.push_back(one.name);
  return names;
}

Result<std::string> TakeReader::file(std::string_view name) const {
  for (const mcap::AttachmentIndex& one : mcap_.summary().attachments) {
    if (one.name == name) return mcap_.attachment(one);
  }
  return Error{ErrorCode::NotFound, fmt::format("'{}': has no file '{}'", mcap_.path(), name)};
}

Result<Description> TakeReader::description() const {
  TakeCursor cursor = messages({{TakeTopic::Description}, {}, {}});
  const Result<std::optional<TakeRecord>> record = cursor.next();
  if (!record) return record.error();
  if (!*record) return Error{ErrorCode::InvalidArgument, fmt::format("'{}': has no description", mcap_.path())};
  return description_of(**record);
}

TakeCursor TakeReader::messages(TakeSelection selection) const { return {*this, std::move(selection)}; }

TakeCursor::TakeCursor(const TakeReader& reader, TakeSelection selection)
    : reader_(reader),
      selection_(std::move(selection)),
      topics_(topics_of(reader.mcap().summary(), selection_)),
      cursor_(reader.mcap(), channels_of(topics_), reader.utc_of(selection_.from)) {}

Result<std::optional<TakeRecord>> TakeCursor::next() {
  for (;;) {
    const Result<std::optional<mcap::Message>> message = cursor_.next();
    if (!message) return message.error();
    if (!*message) return std::optional<TakeRecord>();
    const auto topic = topics_.find((*message)->channel_id);
    if (topic == topics_.end()) continue;
    const TakeRecord record{topic->second, reader_.host_time_of((*message)->log_time_ns), (*message)->data};
    if (selection_.to && record.at >= *selection_.to) return std::optional<TakeRecord>();
    if (!selection_.from || record.at >= *selection_.from) return std::optional(record);
  }
}

}  // namespace mocap::take
