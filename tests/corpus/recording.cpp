#include "corpus/recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <sstream>
#include <utility>

#include "mocap/v1/take.pb.h"
#include "take/mcap/reader.h"
#include "take/mcap/writer.h"
#include "wire/codec/camera_blobs.h"

namespace mocap::corpus {
namespace {

namespace fs = std::filesystem;
using take::mcap::Message;
using take::mcap::MessageCursor;
using take::mcap::Metadata;
using take::mcap::Reader;
using take::mcap::Writer;

constexpr std::array kOrderNames{"lose",         "reset",        "away",       "back",      "reload-same",
                                 "reload-label", "reload-align", "take-start", "take-stop", "take-next",
                                 "take-cancel",  "take-cut",     "disk-full",  "disk-free", "folder-gone"};
static_assert(kOrderNames.size() == static_cast<std::size_t>(OrderKind::FolderGone) + 1);
constexpr std::size_t kMarkerBytes = 2 + 3 * sizeof(float);

Error wrong(const fs::path& path, const std::string& what) {
  return {ErrorCode::InvalidArgument, fmt::format("{}: {}; make the corpus anew", path.string(), what)};
}

std::string bytes_of(const chaos::Arrival& arrival) {
  const auto frame = std::make_unique<BlobFrame>();
  frame->camera = arrival.camera;
  frame->number = arrival.number;
  frame->exposed_at = Timestamp{arrival.stamp};
  frame->received_at = arrival.received;
  frame->detected_at = arrival.first_byte;
  for (const Blob& blob : arrival.blobs) static_cast<void>(frame->blobs.try_push_back(blob));
  v1::CameraBlobs message;
  wire::encode(*frame, message);
  return message.SerializeAsString();
}

std::string bytes_of(const Order& order) {
  return fmt::format("{} {} {}", kOrderNames[static_cast<std::size_t>(order.kind)], order.target, order.amount);
}

std::string bytes_of(const Truth& truth) {
  std::string bytes;
  for (const TrueMarker& marker : truth.markers) {
    bytes += static_cast<char>(marker.subject);
    bytes += static_cast<char>(marker.marker);
    bytes.append(reinterpret_cast<const char*>(marker.position_m), sizeof marker.position_m);
  }
  return bytes;
}

std::optional<chaos::Arrival> arrival_in(std::string_view bytes) {
  v1::CameraBlobs message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return std::nullopt;
  const auto frame = wire::decode(message);
  if (!frame) return std::nullopt;
  return chaos::Arrival{frame->detected_at,
                        frame->received_at,
                        frame->camera,
                        frame->number,
                        frame->exposed_at.time_since_epoch(),
                        {frame->blobs.begin(), frame->blobs.end()}};
}

std::optional<Order> order_in(std::string_view bytes) {
  std::istringstream words{std::string(bytes)};
  std::string name;
  Order order;
  if (!(words >> name >> order.target >> order.amount)) return std::nullopt;
  const auto found = std::find(kOrderNames.begin(), kOrderNames.end(), name);
  if (found == kOrderNames.end()) return std::nullopt;
  order.kind = static_cast<OrderKind>(found - kOrderNames.begin());
  return order;
}

std::optional<std::vector<TrueMarker>> markers_in(std::string_view bytes) {
  if (bytes.size() % kMarkerBytes != 0) return std::nullopt;
  std::vector<TrueMarker> markers;
  for (std::size_t at = 0; at < bytes.size(); at += kMarkerBytes) {
    TrueMarker marker;
    marker.subject = static_cast<std::uint8_t>(bytes[at]);
    marker.marker = static_cast<std::uint8_t>(bytes[at + 1]);
    std::memcpy(marker.position_m, bytes.data() + at + 2, sizeof marker.position_m);
    markers.push_back(marker);
  }
  return markers;
}

// "publisher-stalls 1.05 0.3 0 0": name, begin, duration, target and amount of each fault.
std::string text_of(const std::vector<chaos::Fault>& faults) {
  std::string text;
  for (const chaos::Fault& fault : faults) {
    text += fmt::format("{} {} {} {} {}\n", chaos::name_of(fault.kind), fault.from_s, fault.for_s, fault.target,
                        fault.amount);
  }
  return text;
}

std::optional<std::vector<chaos::Fault>> faults_in(const std::string& text) {
  std::vector<chaos::Fault> faults;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name;
    chaos::Fault fault;
    if (!(words >> name >> fault.from_s >> fault.for_s >> fault.target >> fault.amount)) return std::nullopt;
    const auto kind = chaos::fault_kind_named(name);
    if (!kind) return std::nullopt;
    fault.kind = *kind;
    faults.push_back(fault);
  }
  return faults;
}

Metadata metadata_of(const Recording& recording) {
  return {"corpus",
          {{"about", recording.about},
           {"bodies", fmt::format("{}", fmt::join(recording.bodies, " "))},
           {"rate_hz", fmt::format("{}", recording.rate_hz)},
           {"utc_stamps", recording.utc_stamps ? "1" : "0"},
           {"patience_ns", fmt::format("{}", recording.patience.count())},
           {"seed", fmt::format("{}", recording.seed)},
           {"feed_faults", text_of(recording.feed_faults)}}};
}

// Reads the metadata into a recording without inputs.
std::optional<Recording> head_in(const Reader& reader) {
  if (reader.summary().metadata.size() != 1) return std::nullopt;
  const auto metadata = reader.metadata(reader.summary().metadata[0]);
  if (!metadata) return std::nullopt;
  const auto text = [&](const char* key) {
    const auto found = metadata->texts.find(key);
    return found == metadata->texts.end() ? std::string() : found->second;
  };
  Recording recording;
  recording.about = text("about");
  std::istringstream bodies(text("bodies"));
  for (std::string name; bodies >> name;) recording.bodies.push_back(name);
  std::int64_t patience_ns = 0;
  std::istringstream(text("rate_hz")) >> recording.rate_hz;
  std::istringstream(text("patience_ns")) >> patience_ns;
  std::istringstream(text("seed")) >> recording.seed;
  auto faults = faults_in(text("feed_faults"));
  if (!faults) return std::nullopt;
  recording.feed_faults = *std::move(faults);
  recording.patience = Duration{patience_ns};
  recording.utc_stamps = text("utc_stamps") == "1";
  if (recording.bodies.empty() || !(recording.rate_hz > 0.0) || patience_ns <= 0) return std::nullopt;
  return recording;
}

// Adds one message. Returns whether it could be read.
bool add(Recording& recording, const std::string& topic, const Message& message) {
  const Timestamp at = from_ns(static_cast<std::int64_t>(message.log_time_ns));
  if (topic == "image") {
    auto arrival = arrival_in(message.data);
    if (arrival) recording.inputs.push_back({at, *std::move(arrival)});
    return arrival.has_value();
  }
  if (topic == "order") {
    const auto order = order_in(message.data);
    if (order) recording.inputs.push_back({at, *order});
    return order.has_value();
  }
  auto markers = markers_in(message.data);
  if (markers) recording.truths.push_back({at, *std::move(markers)});
  return markers.has_value();
}

}  // namespace

Status write_recording(const fs::path& path, const Recording& recording) {
  if (fs::exists(path)) return Error{ErrorCode::Busy, path.string() + ": exists already; name an empty folder"};
  take::mcap::WriterSettings settings;
  settings.chunk_span = std::chrono::hours(1);  // one chunk: the best compression
  settings.chunk_bytes = 64 * 1024 * 1024;
  settings.sync = false;
  Result<Writer> writer = Writer::create(path, {"mocap", "mocap-corpus"}, settings);
  if (!writer) return writer.error();
  std::array<std::uint16_t, 3> channels{};
  const std::array topics{"image", "order", "truth"};
  for (std::size_t i = 0; i < topics.size(); ++i) {
    const auto channel = writer->add_channel(topics[i], "", 0);
    if (!channel) return channel.error();
    channels[i] = *channel;
  }
  if (Status added = writer->add_metadata(metadata_of(recording)); !added) return added;
  const auto append = [&](std::size_t topic, Timestamp at, const std::string& bytes) {
    return writer->append(channels[topic], static_cast<std::uint64_t>(to_ns(at)), bytes);
  };
  for (const Input& input : recording.inputs) {
    const bool image = std::holds_alternative<chaos::Arrival>(input.what);
    const std::string bytes = std::visit([](const auto& what) { return bytes_of(what); }, input.what);
    if (Status written = append(image ? 0 : 1, input.at, bytes); !written) return written;
  }
  for (const Truth& truth : recording.truths) {
    if (Status written = append(2, truth.at, bytes_of(truth)); !written) return written;
  }
  return writer->finish();
}

Result<Recording> read_recording(const fs::path& path) {
  const auto reader = Reader::open(path);
  if (!reader) return reader.error();
  if (reader->cut_off()) return wrong(path, "has no end");
  auto recording = head_in(*reader);
  if (!recording) return wrong(path, "has no metadata of a corpus");
  MessageCursor cursor(*reader);
  for (auto message = cursor.next(); !message || *message; message = cursor.next()) {
    if (!message) return message.error();
    const auto& channel = reader->summary().channels.at((*message)->channel_id);
    if (!add(*recording, channel.topic, **message)) return wrong(path, "has a damaged message of " + channel.topic);
  }
  return *std::move(recording);
}

}  // namespace mocap::corpus
