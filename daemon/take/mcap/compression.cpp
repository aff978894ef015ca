#include "take/mcap/compression.h"

#include <fmt/core.h>
#include <lz4frame.h>
#include <zstd.h>

#include "base/expects.h"

namespace mocap::take::mcap {
namespace {

constexpr int kZstdLevel = 1;

Error not_decompressed(std::string_view compression, const char* why) {
  return {ErrorCode::InvalidArgument, fmt::format("its records cannot be uncompressed ({}: {})", compression, why)};
}

Result<std::string> uncompress_zstd(std::string_view records, std::uint64_t size) {
  std::string out(size, '\0');
  const std::size_t written = ZSTD_decompress(out.data(), out.size(), records.data(), records.size());
  if (ZSTD_isError(written) != 0U) return not_decompressed("zstd", ZSTD_getErrorName(written));
  if (written != size) return not_decompressed("zstd", "the chunk announces another size");
  return out;
}

Result<std::string> uncompress_lz4(std::string_view records, std::uint64_t size) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0U) {
    return not_decompressed("lz4", "no memory");
  }
  const std::unique_ptr<LZ4F_dctx, LZ4F_errorCode_t (*)(LZ4F_dctx*)> owner(context, LZ4F_freeDecompressionContext);
  std::string out(size, '\0');
  std::size_t read = 0, written = 0, hint = 1;
  while (hint != 0 && read < records.size()) {
    std::size_t out_bytes = out.size() - written, in_bytes = records.size() - read;
    hint = LZ4F_decompress(context, out.data() + written, &out_bytes, records.data() + read, &in_bytes, nullptr);
    if (LZ4F_isError(hint) != 0U) return not_decompressed("lz4", LZ4F_getErrorName(hint));
    if (in_bytes == 0 && out_bytes == 0) return not_decompressed("lz4", "the chunk announces another size");
    read += in_bytes;
    written += out_bytes;
  }
  if (hint != 0 || read != records.size() || written != size)
    return not_decompressed("lz4", "the chunk announces another size");
  return out;
}

}  // namespace

std::string_view name_of(Compression compression) {
  switch (compression) {
    case Compression::Zstd: return "zstd";
    case Compression::Lz4: return "lz4";
    case Compression::None: break;
  }
  return "";
}

struct Compressor::Libraries {
  std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> zstd{nullptr, ZSTD_freeCCtx};
};

Compressor::Compressor(Compression compression) : compression_(compression), libraries_(std::make_unique<Libraries>()) {
  if (compression == Compression::Zstd) libraries_->zstd.reset(ZSTD_createCCtx());
}

Compressor::Compressor(Compressor&&) noexcept = default;
Compressor::~Compressor() = default;

std::string_view Compressor::compress(std::string_view records) {
  if (compression_ == Compression::None) return records;
  std::size_t size = 0;
  if (compression_ == Compression::Zstd) {
    out_.resize(ZSTD_compressBound(records.size()));
    size =
        ZSTD_compressCCtx(libraries_->zstd.get(), out_.data(), out_.size(), records.data(), records.size(), kZstdLevel);
    MOCAP_EXPECTS(ZSTD_isError(size) == 0U);
  } else {
    out_.resize(LZ4F_compressFrameBound(records.size(), nullptr));
    size = LZ4F_compressFrame(out_.data(), out_.size(), records.data(), records.size(), nullptr);
    MOCAP_EXPECTS(LZ4F_isError(size) == 0U);
  }
  return std::string_view(out_).substr(0, size);
}

Result<std::string> uncompress(std::string_view compression, std::string_view records,
                               std::uint64_t uncompressed_bytes) {
  if (compression == "zstd") return uncompress_zstd(records, uncompressed_bytes);
  if (compression == "lz4") return uncompress_lz4(records, uncompressed_bytes);
  if (!compression.empty()) {
    return Error{ErrorCode::Unsupported,
                 fmt::format("its compression is '{}', expected zstd, lz4 or none", compression)};
  }
  if (records.size() != uncompressed_bytes) return not_decompressed("none", "the chunk announces another size");
  return std::string(records);
}

}  // namespace mocap::take::mcap
