#include "take/recordings/snapshot_reader.h"

#include <fmt/core.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include "take/take_reader.h"
#include "wire/codec/decode.h"
#include "wire/codec/json.h"

namespace mocap::take {
namespace {

// Converts messages to snapshots, for every form of a recording.
class MessageReader : public SnapshotReader {
 public:
  explicit MessageReader(const std::filesystem::path& path) : path_(path) {}

  Result<const RecordedSnapshot*> next() final {
    Result<bool> found = next_message();
    if (!found) return found.error();
    if (!*found) return static_cast<const RecordedSnapshot*>(nullptr);
    if (const Status read = read_message(); !read) return wrong(read.error().message);
    return static_cast<const RecordedSnapshot*>(&recorded_);
  }
  const Description& description() const final { return description_; }
  const std::vector<RecordedMark>& marks() const final { return marks_; }
  const RecordingFaults& faults() const final { return faults_; }

 protected:
  // Reads the next message into message_. False at the end.
  virtual Result<bool> next_message() = 0;
  // Names the message that was read last.
  virtual std::string place() const = 0;

  Error wrong(const std::string& why) const {
    return {ErrorCode::InvalidArgument, fmt::format("{}:{}: {}", path_.string(), place(), why)};
  }

  // Takes over the description of the messages that follow.
  Status learn(Result<Description> read) {
    if (!read) return read.error();
    description_ = std::move(*read);
    described_ = true;
    return {};
  }

  // Whether a description was read.
  bool described() const noexcept { return described_; }

  std::filesystem::path path_;
  v1::Snapshot message_;
  std::vector<RecordedMark> marks_;
  RecordingFaults faults_;

 private:
  Status read_message() {
    if (message_.has_description()) {
      if (const Status learnt = learn(wire::decode(message_.description())); !learnt) return learnt;
    }
    if (!described_) {
      return Error{ErrorCode::InvalidArgument,
                   "the recording has no description, which names markers and bones; record with [record]"};
    }
    Result<Snapshot> snapshot = wire::decode(message_);
    if (!snapshot) return snapshot.error();
    recorded_.snapshot = std::move(*snapshot);
    wire::put_at_rest_offsets(message_, description_, recorded_.snapshot);
    recorded_.utc_minus_host_ns.reset();
    if (message_.has_utc_minus_host_ns()) recorded_.utc_minus_host_ns = message_.utc_minus_host_ns();
    return {};
  }

  bool described_ = false;
  Description description_;
  RecordedSnapshot recorded_;
};

class FileReader : public MessageReader {
 public:
  explicit FileReader(const std::filesystem::path& path)
      : MessageReader(path), bytes_(std::filesystem::file_size(path)), file_(path, std::ios::binary) {}

  double progress() const final {
    return bytes_ == 0 ? 1.0 : std::min(1.0, static_cast<double>(position()) / static_cast<double>(bytes_));
  }

 protected:
  // Number of bytes that were read.
  virtual std::uint64_t position() const = 0;

  std::uint64_t bytes_;
  std::ifstream file_;
};

class ProtobufReader final : public FileReader {
 public:
  explicit ProtobufReader(const std::filesystem::path& path) : FileReader(path), stream_(&file_) {}

 private:
  Result<bool> next_message() override {
    at_ = stream_.ByteCount();
    message_.Clear();
    bool at_end = false;
    if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&message_, &stream_, &at_end)) return true;
    // The last message of a recording that was cut off is incomplete, so that reading it reaches the end of the file.
    faults_.cut_off |= !at_end && position() >= bytes_;
    if (at_end || faults_.cut_off) return false;
    return wrong("not a message of mocap.v1.Snapshot");
  }
  std::uint64_t position() const override { return static_cast<std::uint64_t>(stream_.ByteCount()); }
  std::string place() const override { return fmt::format("byte {}", at_); }

  google::protobuf::io::IstreamInputStream stream_;
  std::int64_t at_ = 0;
};

class JsonReader final : public FileReader {
 public:
  using FileReader::FileReader;

 private:
  Result<bool> next_message() override {
    while (std::getline(file_, line_)) {
      ++number_;
      read_bytes_ += line_.size() + 1;
      if (line_.find_first_not_of(" \t\r") == std::string::npos) continue;
      Result<v1::Snapshot> message = wire::message_from_json_line(line_);
      faults_.cut_off = !message && file_.eof();  // within its last line
      if (faults_.cut_off) return false;
      if (!message) return wrong(message.error().message);
      message_ = std::move(*message);
      return true;
    }
    return false;
  }
  std::uint64_t position() const override { return read_bytes_; }
  std::string place() const override { return fmt::format("{}", number_); }

  std::string line_;
  std::uint64_t number_ = 0, read_bytes_ = 0;
};

class McapReader final : public MessageReader {
 public:
  McapReader(const std::filesystem::path& path, TakeReader take)
      : MessageReader(path),
        take_(std::move(take)),
        cursor_(take_.messages({{TakeTopic::Description, TakeTopic::Snapshot, TakeTopic::Event}, {}, {}})) {
    // A damage without bytes is that of the index, which is made anew.
    for (const mcap::Damage& damage : take_.mcap().damages()) {
      if (damage.bytes > 0) count_damage(fmt::format("'{}', {}", path.string(), damage.what));
    }
    faults_.cut_off = take_.cut_off();
    faults_.being_written = take_.cut_off() && take_.is_being_written();
  }

  double progress() const override {
    const double span_s = to_s(take_.last_at() - take_.first_at());
    return span_s > 0.0 ? std::clamp(to_s(at_ - take_.first_at()) / span_s, 0.0, 1.0) : 1.0;
  }

 private:
  Result<bool> next_message() override {
    for (;;) {
      const Result<std::optional<TakeRecord>> record = cursor_.next();
      if (!record && record.error().code != ErrorCode::InvalidArgument) return record.error();
      if (!record) {
        count_damage(record.error().message);  // the cursor is behind the damaged chunk now
        continue;
      }
      if (!*record) return end();
      at_ = (*record)->at;
      if ((*record)->topic == TakeTopic::Event) {
        learn_mark(**record);
        continue;
      }
      if ((*record)->topic == TakeTopic::Description) {
        if (const Status learnt = learn(description_of(**record)); !learnt) return wrong(learnt.error().message);
        continue;
      }
      Result<v1::Snapshot> message = snapshot_message_of(**record);
      if (!message) return wrong(message.error().message);
      if (is_undescribed(*message)) {
        ++faults_.undescribed_snapshots;
        continue;
      }
      message_ = std::move(*message);
      return true;
    }
  }

  // False, or the damage that left nothing to be read.
  Result<bool> end() const {
    if (described() || faults_.undescribed_snapshots == 0) return false;
    const std::string damage = first_damage_.empty()
                                   ? fmt::format("'{}': 'take repair' left out a damaged part", path_.string())
                                   : first_damage_;
    return Error{ErrorCode::InvalidArgument,
                 damage + "; no description of the snapshots is left, which names markers and bones"};
  }

  // Whether the description that a snapshot refers to was lost. Versions only grow. A snapshot may be older than the
  // description before it: a new description is written before the last snapshots of the old one.
  bool is_undescribed(const v1::Snapshot& snapshot) const {
    const bool lacks_parts = faults_.damaged_parts > 0 || take_.info().repaired;
    return lacks_parts && (!described() || snapshot.description_version() > description().version);
  }

  void learn_mark(const TakeRecord& record) {
    const Result<v1::Event> event = event_of(record);
    if (!event) return count_damage(wrong(event.error().message).message);
    if (event->kind() == v1::EVENT_KIND_MARK) marks_.push_back({record.at, event->message()});
  }

  void count_damage(const std::string& what) {
    ++faults_.damaged_parts;
    if (first_damage_.empty()) first_damage_ = what;
  }

  std::string place() const override { return fmt::format("{} ns", to_ns(at_)); }

  TakeReader take_;
  TakeCursor cursor_;  // of take_
  std::string first_damage_;
  Timestamp at_ = take_.first_at();
};

Result<std::unique_ptr<SnapshotReader>> open_take(const std::filesystem::path& path) {
  Result<TakeReader> take = TakeReader::open(path);
  if (!take) return take.error();
  return std::unique_ptr<SnapshotReader>(std::make_unique<McapReader>(path, std::move(*take)));
}

}  // namespace

Result<std::unique_ptr<SnapshotReader>> open_snapshots(const std::filesystem::path& path) {
  const auto ending = path.extension();
  if (ending == ".mcap") return open_take(path);
  if (ending != ".jsonl" && ending != ".pb") {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{}: ends in '{}', expected .mcap, .pb or .jsonl", path.string(), ending.string())};
  }
  std::error_code failed;
  if (!std::filesystem::is_regular_file(path, failed)) {
    return Error{ErrorCode::NotFound, fmt::format("{}: is not a file", path.string())};
  }
  if (!std::ifstream(path)) {
    return Error{ErrorCode::Io, fmt::format("{}: cannot be read: {}", path.string(), std::strerror(errno))};
  }
  if (ending == ".pb") return std::unique_ptr<SnapshotReader>(std::make_unique<ProtobufReader>(path));
  return std::unique_ptr<SnapshotReader>(std::make_unique<JsonReader>(path));
}

}  // namespace mocap::take
