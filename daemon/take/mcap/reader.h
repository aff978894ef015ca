#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"
#include "take/mcap/chunk_content.h"
#include "take/mcap/input_file.h"
#include "take/mcap/scan.h"
#include "take/mcap/summary.h"

namespace mocap::take::mcap {

/// Reads an MCAP file by its index, or, if it has no valid index, by a scan of the whole file.
class Reader {
 public:
  /// Fails with NotFound, Io and InvalidArgument (not an MCAP file).
  static Result<Reader> open(const std::filesystem::path& path);

  const std::string& path() const noexcept { return file_.path(); }
  const InputFile& file() const noexcept { return file_; }
  const Header& header() const noexcept { return header_; }
  const Summary& summary() const noexcept { return summary_; }

  /// The file has no end: its writer was stopped, or still writes.
  bool cut_off() const noexcept { return cut_off_; }
  /// Empty for a file with a valid index, whose data are checked when they are read.
  const std::vector<Damage>& damages() const noexcept { return damages_; }

  /// Each fails with InvalidArgument; the message names the byte.
  Result<Metadata> metadata(const MetadataIndex& index) const;
  Result<std::string> attachment(const AttachmentIndex& index) const;
  Result<ChunkContent> chunk(const ChunkIndex& index) const;

 private:
  explicit Reader(InputFile file) : file_(std::move(file)) {}
  Status read_index();
  Result<std::string> record_bytes(std::uint64_t offset, std::uint64_t length, Opcode opcode) const;

  InputFile file_;
  Header header_;
  Summary summary_;
  bool cut_off_ = false;
  std::vector<Damage> damages_;
};

/// Passes over the messages of a file in the order of their times; equal times in the order of the file. Holds the
/// chunks that overlap in time, at most kMaxRecord_bytes of them. The Reader outlives the cursor.
class MessageCursor {
 public:
  /// Messages of these channels; of all if `channels` is empty. Chunks that end before `from_ns` are not read; other
  /// messages before that time are returned.
  explicit MessageCursor(const Reader& reader, std::set<std::uint16_t> channels = {}, std::uint64_t from_ns = 0);

  /// The next message, valid until the next call; nothing at the end. Fails with InvalidArgument and Io; the message
  /// names the byte. After a failure the next call continues behind the damaged chunk.
  Result<std::optional<Message>> next();

 private:
  struct OpenChunk {
    ChunkContent content;
    std::vector<MessagePlace> messages;  // selected, by time
    std::size_t next = 0;
  };
  bool is_selected(const ChunkIndex& chunk) const;
  Status open_until(std::optional<std::uint64_t> time_ns);
  Status open(const ChunkIndex& chunk);
  OpenChunk* earliest();

  const Reader& reader_;
  std::set<std::uint16_t> channels_;
  std::uint64_t from_ns_;
  std::vector<const ChunkIndex*> chunks_;  // by start
  std::size_t next_chunk_ = 0;
  std::vector<std::unique_ptr<OpenChunk>> open_;
  std::uint64_t open_bytes_ = 0;
};

}  // namespace mocap::take::mcap
