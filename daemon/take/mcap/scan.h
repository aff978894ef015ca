#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "take/mcap/chunk_content.h"
#include "take/mcap/input_file.h"
#include "take/mcap/summary.h"

namespace mocap::take::mcap {

/// Damaged bytes of a file; what they held is missing.
struct Damage {
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::string what;  ///< names the byte
};

/// The content of a file, found without its index.
struct Scan {
  Header header;
  Summary summary;
  std::vector<Damage> damages;
  std::uint64_t data_bytes = 0;      ///< the data section, with the first magic, up to its last whole record
  std::uint32_t data_crc = 0;        ///< of these bytes
  bool has_end = false;              ///< the data section has its last record, the DataEnd
  std::uint64_t loose_messages = 0;  ///< outside of chunks; each is a chunk of its own in the summary
  std::uint32_t announced_crc = 0;   ///< of the DataEnd; 0: unknown
};

/// Receives the records of the data section while they are scanned.
struct ScanVisitor {
  /// `bytes`: the whole record, no message index and no DataEnd. `content`: of a chunk, otherwise null.
  std::function<Status(const RawRecord& record, std::string_view bytes, const ChunkContent* content)> on_record;
};

/// Reads the data section from its first byte to its last whole record and checks every checksum. A damaged chunk is
/// left out. So are messages outside of chunks in a file with chunks: they have no checksum. If the length of a record
/// is damaged, the scan continues at the next chunk. Fails with InvalidArgument if the file does not begin as an MCAP
/// file, and with Io and with the errors of `visitor`. Holds one record at a time.
///
/// `index`: the valid index of the file, or null. It has the schemas and channels that the data section must have, so
/// that a damaged one does not make all chunks unreadable.
Result<Scan> scan(const InputFile& file, const ScanVisitor& visitor = {}, const Summary* index = nullptr);

}  // namespace mocap::take::mcap
