#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "module/recording_size.h"
#include "take/mcap/compression.h"
#include "take/mcap/records.h"
#include "take/mcap/summary.h"
#include "take/recordings/output_file.h"

namespace mocap::take::mcap {

/// Metadata up to this size can be added to a recording that a full disk has ended.
inline constexpr std::size_t kMaxLastMetadata_bytes = 32 * 1024;

struct WriterSettings {
  Compression compression = Compression::Zstd;
  /// A chunk is written when its messages span this time. After a crash the last chunk is missing.
  Duration chunk_span = std::chrono::milliseconds(50);
  std::uint64_t chunk_bytes = 1024 * 1024;  ///< ... or when its records have this size
  /// Waits after each chunk until the disk has the chunk, so that a power cut loses no more than a crash.
  bool sync = true;
};

/// Writes an MCAP file (https://mcap.dev/spec): messages in compressed chunks, with checksums, and an index at the end.
///
/// The file is only appended to, so a file that a crash cut off is readable up to its last whole chunk. Before each
/// chunk, space is reserved for the chunk and the index: when the disk is full, `append` fails with Io, and `finish`
/// still completes the file. On a file system that cannot reserve, the file then ends with its last whole chunk, and
/// `finish` fails too. One thread owns a Writer.
class Writer {
 public:
  /// Creates a file; an existing one is kept (OutputFile::create). Fails with Io.
  static Result<Writer> create(const std::filesystem::path& path, const Header& header, WriterSettings settings);

  /// Returns the id of the schema.
  Result<std::uint16_t> add_schema(std::string name, std::string encoding, std::string data);
  /// Returns the id of the channel. `schema`: 0 or the id of a schema.
  Result<std::uint16_t> add_channel(std::string topic, std::string message_encoding, std::uint16_t schema);
  Status add_attachment(const Attachment& attachment);
  /// After a full disk: fails for more than kMaxLastMetadata_bytes.
  Status add_metadata(const Metadata& metadata);

  /// Appends a message to the open chunk. Precondition: `channel` is the id of a channel. Fails with Io, and with
  /// InvalidArgument for messages over kMaxRecord_bytes / 2.
  Status append(std::uint16_t channel, std::uint64_t log_time_ns, std::string_view data);

  /// Writes the open chunk.
  Status write_chunk();

  /// Writes the open chunk and the index, flushes the file to the disk and closes it.
  Status finish();

  const std::string& path() const noexcept { return file_.path(); }
  /// Bytes with the open chunk uncompressed; records are messages. Messages of a chunk that could not be written are
  /// not counted.
  RecordingSize size() const noexcept;
  /// The earliest time of the open chunk; nothing if it is empty.
  std::optional<std::uint64_t> open_since_ns() const noexcept;

 private:
  Writer(OutputFile file, WriterSettings settings);
  Status reserve(std::uint64_t bytes);
  Status write(std::string_view bytes);
  Status fail(Error error);

  OutputFile file_;
  WriterSettings settings_;
  Compressor compressor_;
  Summary summary_;
  std::uint64_t written_bytes_ = 0;
  std::uint32_t crc_ = 0;
  std::uint64_t summary_bytes_ = 0;           // bound on the size of the index
  std::vector<std::uint32_t> sequences_;      // by channel id
  std::string chunk_;                         // records of the open chunk
  std::vector<MessageIndex> chunk_messages_;  // by channel id
  std::uint64_t chunk_start_ns_ = 0;
  std::uint64_t chunk_end_ns_ = 0;
  std::string bytes_;
  std::optional<Error> failure_;
};

}  // namespace mocap::take::mcap
