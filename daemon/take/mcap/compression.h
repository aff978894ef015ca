#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"

namespace mocap::take::mcap {

enum class Compression { None, Zstd, Lz4 };

/// The name of a compression in an MCAP file: "", "zstd" or "lz4".
std::string_view name_of(Compression compression);

/// Compresses the records of chunks, zstd at level 1 (decisions/0002). One thread owns it.
class Compressor {
 public:
  explicit Compressor(Compression compression);
  Compressor(Compressor&&) noexcept;
  ~Compressor();

  Compression compression() const noexcept { return compression_; }

  /// Valid until the next call. A compression that fails, for lack of memory, is a bug.
  std::string_view compress(std::string_view records);

 private:
  struct Libraries;
  Compression compression_;
  std::string out_;
  std::unique_ptr<Libraries> libraries_;
};

/// Uncompresses the records of a chunk into exactly `uncompressed_bytes` bytes. Fails with Unsupported (another name of
/// a compression) and InvalidArgument (damaged, or another size).
Result<std::string> uncompress(std::string_view compression, std::string_view records,
                               std::uint64_t uncompressed_bytes);

}  // namespace mocap::take::mcap
