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
  int width_px = 0;  ///< 0: unknown when the recording started
  int height_px = 0;
};

/// The blobs of one image. Unlike BlobFrame, its size depends on the number of blobs.
struct RecordedPicture {
  std::uint64_t number = 0;
  Timestamp exposed_at;
  std::vector<Blob> blobs;  ///< without 2D tracks
};

/// A blob recording (proto/mocap/v1/blobs.proto).
struct BlobRecording {
  std::vector<RecordedCamera> cameras;
  std::vector<std::vector<RecordedPicture>> pictures;  ///< by camera, in the order of exposure
  bool cut_off = false;                                ///< the file ends within an image, which is omitted
};

/// Starts a blob recording. An existing file is kept, and the new one has a number in its name (OutputFile::create).
/// Blobs are written in pieces, so that after a crash all but the last images can be read. After a failed write the
/// file ends with the last whole image. Fails with InvalidArgument (a name that does not end in .blobs) and Io.
Result<std::unique_ptr<BlobWriter>> make_blob_writer(const std::filesystem::path& path,
                                                     std::span<const RecordedCamera> cameras);

/// Reads a complete blob recording. Fails with NotFound, Io, Unsupported (a newer version) and InvalidArgument (not a
/// blob recording, or damaged; the message names the byte).
Result<BlobRecording> read_blob_recording(const std::filesystem::path& path);

}  // namespace mocap::take
