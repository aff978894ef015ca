#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/blob.h"
#include "module/blob_writer.h"

namespace mocap::take {

struct RecordedCamera {
  std::string name;
  int width_px = 0;  ///< 0: not known when the recording began
  int height_px = 0;
};

/// What one camera saw at one instant; as BlobFrame, and as small as what was seen.
struct RecordedPicture {
  std::uint64_t number = 0;
  Timestamp exposed_at;
  std::vector<Blob> blobs;  ///< without 2D tracks
};

/// A blob recording (proto/mocap/v1/blobs.proto).
struct BlobRecording {
  std::vector<RecordedCamera> cameras;
  std::vector<std::vector<RecordedPicture>> pictures;  ///< by camera, in the order of their exposure
  bool cut_off = false;                                ///< the file ends within a picture, which is left out
};

/// Begins a blob recording; what stood at `path` is gone. The file grows as it is written, so that after a crash all
/// but the last pictures can be read. Fails with InvalidArgument (a name that does not end in .blobs) and Io.
Result<std::unique_ptr<BlobWriter>> make_blob_writer(const std::filesystem::path& path,
                                                     std::span<const RecordedCamera> cameras);

/// Reads a whole one. Fails with NotFound, Io, Unsupported (a newer version) and InvalidArgument: what is no blob
/// recording, or is damaged (at which byte), and values that no detector gives.
Result<BlobRecording> read_blob_recording(const std::filesystem::path& path);

}  // namespace mocap::take
