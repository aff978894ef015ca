#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "mocap/v1/event.pb.h"
#include "mocap/v1/snapshot.pb.h"
#include "model/blob.h"
#include "model/description.h"
#include "model/health.h"
#include "model/snapshot.h"
#include "take/mcap/reader.h"
#include "take/take_info.h"

namespace mocap::take {

enum class TakeTopic { Description, Snapshot, Blobs, Health, Event, Other };

/// One message of a take. The bytes are valid until the cursor moves.
struct TakeRecord {
  TakeTopic topic = TakeTopic::Other;
  Timestamp at;  ///< host clock of the recording
  std::string_view bytes;
};

// Each decodes a record of its topic. Fails with InvalidArgument.
Result<Description> description_of(const TakeRecord& record);
Result<Snapshot> snapshot_of(const TakeRecord& record);
Result<v1::Snapshot> snapshot_message_of(const TakeRecord& record);
Result<BlobFrame> blobs_of(const TakeRecord& record);
Result<Health> health_of(const TakeRecord& record);
Result<v1::Event> event_of(const TakeRecord& record);

/// Which messages of a take a cursor returns.
struct TakeSelection {
  std::set<TakeTopic> topics = {};     ///< empty: all
  std::optional<Timestamp> from = {};  ///< from this instant, included
  std::optional<Timestamp> to = {};    ///< up to this instant, not included
  std::string camera = {};             ///< of Blobs: only the images of this camera; empty: of all
};

class TakeCursor;

/// Reads a take. A take that was cut off is read up to its last whole chunk.
class TakeReader {
 public:
  /// Fails with NotFound, Io, Unsupported (a newer format) and InvalidArgument (not an MCAP file, or not a take).
  static Result<TakeReader> open(const std::filesystem::path& path);

  const TakeInfo& info() const noexcept { return info_; }
  const mcap::Reader& mcap() const noexcept { return mcap_; }
  bool cut_off() const noexcept { return mcap_.cut_off(); }
  /// Written to its end, and never repaired. The data are checked when they are read.
  bool is_whole() const noexcept { return !mcap_.cut_off() && !info_.repaired && mcap_.damages().empty(); }
  bool is_being_written() const { return mcap_.file().is_being_written(); }

  /// Number of messages by topic, in the order of the names.
  std::map<std::string, std::uint64_t> counts() const;
  /// The times of the earliest and of the latest message; equal if there is none.
  Timestamp first_at() const;
  Timestamp last_at() const;

  std::vector<std::string> files() const;
  /// Fails with NotFound and InvalidArgument (damaged).
  Result<std::string> file(std::string_view name) const;

  /// The first description. Fails with InvalidArgument if there is none.
  Result<Description> description() const;

  /// Messages in the order of their times. The TakeReader outlives the cursor.
  TakeCursor messages(TakeSelection selection = {}) const;

 private:
  friend class TakeCursor;
  explicit TakeReader(mcap::Reader mcap) : mcap_(std::move(mcap)) {}
  Status read_info();
  Timestamp host_time_of(std::uint64_t utc_ns) const;
  std::uint64_t utc_of(const std::optional<Timestamp>& at) const;

  mcap::Reader mcap_;
  TakeInfo info_;
};

/// Passes over messages of a take.
class TakeCursor {
 public:
  /// The next message; nothing at the end. Fails with InvalidArgument and Io; the message names file and byte.
  Result<std::optional<TakeRecord>> next();

 private:
  friend class TakeReader;
  TakeCursor(const TakeReader& reader, TakeSelection selection);

  const TakeReader& reader_;
  TakeSelection selection_;
  std::map<std::uint16_t, TakeTopic> topics_;  // by channel
  mcap::MessageCursor cursor_;
};

}  // namespace mocap::take
