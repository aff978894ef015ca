#include "take/take_writer.h"

#include <fmt/core.h>

#include "base/expects.h"
#include "base/log.h"
#include "mocap/v1/event.pb.h"
#include "mocap/v1/health.pb.h"
#include "mocap/v1/take.pb.h"
#include "take/take_schemas.h"
#include "wire/codec/camera_blobs.h"
#include "wire/codec/encode.h"

namespace mocap::take {

// Reused, so that a message does not allocate.
struct TakeWriter::Messages {
  v1::Snapshot snapshot;
  v1::CameraBlobs blobs;
  v1::Health health;
  std::string bytes;
};

TakeWriter::TakeWriter(mcap::Writer writer, TakeInfo info, mcap::WriterSettings settings)
    : writer_(std::move(writer)),
      info_(std::move(info)),
      chunk_span_(settings.chunk_span),
      messages_(std::make_unique<Messages>()) {}

TakeWriter::~TakeWriter() = default;

Result<std::unique_ptr<TakeWriter>> TakeWriter::create(const std::filesystem::path& path, const TakeStart& start,
                                                       mcap::WriterSettings settings) {
  if (path.extension() != ".mcap") {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("take '{}': ends in '{}', expected .mcap", path.string(), path.extension().string())};
  }
  if (const Status valid = check(start.info); !valid) return valid.error();
  if (start.description.cameras.size() > kMaxCameras) {
    return Error{ErrorCode::InvalidArgument, fmt::format("take '{}': {} cameras, expected at most {}", path.string(),
                                                         start.description.cameras.size(), kMaxCameras)};
  }
  Result<mcap::Writer> writer = mcap::Writer::create(path, {"mocap", start.info.producer}, settings);
  if (!writer) return writer.error();
  std::unique_ptr<TakeWriter> take(new TakeWriter(*std::move(writer), start.info, settings));  // NOLINT: private
  if (const Status begun = take->begin(start); !begun) return begun.error();
  return take;
}

Status TakeWriter::begin(const TakeStart& start) {
  MOCAP_EXPECTS(start.info.started_at);
  const std::pair<std::string_view, const google::protobuf::Descriptor*> types[] = {
      {"mocap.v1.Description", v1::Description::descriptor()},
      {"mocap.v1.Snapshot", v1::Snapshot::descriptor()},
      {"mocap.v1.CameraBlobs", v1::CameraBlobs::descriptor()},
      {"mocap.v1.Health", v1::Health::descriptor()},
      {"mocap.v1.Event", v1::Event::descriptor()}};
  for (const auto& [name, type] : types) {
    const auto id = writer_.add_schema(std::string(name), "protobuf", schema_of(*type));
    if (!id) return id.error();
    schemas_.emplace(name, *id);
  }
  const std::pair<std::string_view, std::string_view> topics[] = {{kDescriptionTopic, "mocap.v1.Description"},
                                                                  {kSnapshotTopic, "mocap.v1.Snapshot"},
                                                                  {kHealthTopic, "mocap.v1.Health"},
                                                                  {kEventTopic, "mocap.v1.Event"}};
  for (const auto& [topic, type] : topics) {
    if (const Status added = add_topic(std::string(topic), type); !added) return added;
  }
  for (const CameraModel& camera : start.description.cameras) {
    const std::string topic = std::string(kBlobsTopics) + camera.name;
    if (const Status added = add_topic(topic, "mocap.v1.CameraBlobs"); !added) return added;
    blob_channels_.push_back(channels_.at(topic));
  }
  if (const Status added = writer_.add_metadata(encode(info_)); !added) return added;
  for (const TakeFile& file : start.files) {
    if (const Status added = attach(file); !added) return added;
  }
  if (const Status appended = append(start.description, *info_.started_at); !appended) return appended;
  return writer_.write_chunk();
}

Status TakeWriter::attach(const TakeFile& file) {
  const auto utc_ns = static_cast<std::uint64_t>(to_ns(*info_.started_at + info_.utc_minus_host));
  return writer_.add_attachment({utc_ns, 0, file.name, file.media_type, file.bytes});
}

Status TakeWriter::add_topic(const std::string& topic, std::string_view message_type) {
  const auto id = writer_.add_channel(topic, "protobuf", schemas_.find(message_type)->second);
  if (!id) return id.error();
  if (!channels_.emplace(topic, *id).second) {
    return Error{ErrorCode::InvalidArgument, fmt::format("take '{}': the topic '{}' occurs twice", path(), topic)};
  }
  return {};
}

Status TakeWriter::append_to(std::uint16_t channel, Timestamp at, std::string_view message) {
  const std::int64_t utc_ns = to_ns(at + info_.utc_minus_host);
  if (utc_ns < 0) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("take '{}': a message at {} ns UTC, expected a time after 1970", path(), utc_ns)};
  }
  return writer_.append(channel, static_cast<std::uint64_t>(utc_ns), message);
}

Status TakeWriter::append(std::string_view topic, Timestamp at, std::string_view message) {
  const auto channel = channels_.find(topic);
  if (channel == channels_.end()) {
    return Error{ErrorCode::InvalidArgument, fmt::format("take '{}': no topic '{}'", path(), topic)};
  }
  return append_to(channel->second, at, message);
}

Status TakeWriter::append(const Snapshot& snapshot) {
  wire::encode(snapshot, messages_->snapshot);
  messages_->snapshot.set_utc_minus_host_ns(info_.utc_minus_host.count());
  messages_->snapshot.SerializeToString(&messages_->bytes);
  return append(kSnapshotTopic, snapshot.instants.exposed_at, messages_->bytes);
}

Status TakeWriter::append(const BlobFrame& frame) {
  MOCAP_EXPECTS(frame.camera.value < blob_channels_.size());
  wire::encode(frame, messages_->blobs);
  messages_->blobs.SerializeToString(&messages_->bytes);
  return append_to(blob_channels_[frame.camera.value], frame.exposed_at, messages_->bytes);
}

Status TakeWriter::append(const Description& description, Timestamp at) {
  wire::encode(description).SerializeToString(&messages_->bytes);
  return append(kDescriptionTopic, at, messages_->bytes);
}

Status TakeWriter::append(const Health& health, Timestamp at) {
  wire::encode(health, messages_->health);
  messages_->health.SerializeToString(&messages_->bytes);
  return append(kHealthTopic, at, messages_->bytes);
}

Status TakeWriter::tick(Timestamp now) {
  const auto since = writer_.open_since_ns();
  const std::int64_t utc_ns = to_ns(now + info_.utc_minus_host);
  if (!since || utc_ns - static_cast<std::int64_t>(*since) < chunk_span_.count()) return {};
  return writer_.write_chunk();
}

// The last info of the file. `create` has checked the info of the start, so that its texts fit.
TakeInfo TakeWriter::last_info(const TakeInfo& end) const {
  const Status valid = check(end);
  TakeInfo info = valid ? end : info_;
  info.utc_minus_host = info_.utc_minus_host;  // the times of the messages depend on it
  if (valid) return info;
  log_warn("take",
           fmt::format("'{}' keeps name, notes, tags and timecodes of its start: {}", path(), valid.error().message));
  info.ended_at = end.ended_at;
  info.others = end.others;
  return info;
}

Status TakeWriter::finish(const TakeInfo& info) {
  const Status written = writer_.write_chunk();
  const Status described = writer_.add_metadata(encode(last_info(info)));
  const Status finished = writer_.finish();
  if (!written) return written;
  return described ? finished : described;
}

}  // namespace mocap::take
