#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/retrack/span.h"
#include "take/take_reader.h"

namespace mocap::join {

/// One chunk of a take.
struct ChunkTake {
  take::TakeReader reader;
  retrack::Span part;  ///< what it has: without a beginning in the first chunk, and an end in the last
};

/// All chunks of a take, the first one first.
struct ChunkTakes {
  std::vector<ChunkTake> chunks;
  std::string made_of;  ///< digest of what the joined take is made of
};

/// Opens the chunks, in any order. Fails as TakeReader::open does, and with InvalidArgument: a file is no chunk; they
/// are not of one take, tracked with the same settings by the same version; one is missing or is there twice; one is
/// cut off, or was repaired, so that its end may be missing. The message names the file.
Result<ChunkTakes> open_chunks(const std::vector<std::filesystem::path>& files);

/// The digest of the inputs of the joined take (as ChunkTakes::made_of). Some of its chunks may be missing; otherwise
/// fails as open_chunks does.
Result<std::string> made_of(const std::vector<std::filesystem::path>& chunks);

}  // namespace mocap::join
