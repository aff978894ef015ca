#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/time.h"

typedef struct _ArvBuffer ArvBuffer;  // NOLINT(bugprone-reserved-identifier): Aravis's own names, for pointers only
typedef struct _ArvCamera ArvCamera;  // NOLINT(bugprone-reserved-identifier)
typedef struct _ArvGcNode ArvGcNode;  // NOLINT(bugprone-reserved-identifier)

namespace mocap::cameras {

/// Reads the chunk data that a camera appends to each image (GenICam): begin of the exposure on the camera's clock, and
/// its length. One thread, while the camera is open.
///
/// Aravis's ArvChunkParser is not used: it parses the camera's feature description again, and two concurrent parsers
/// corrupt each other (decisions/0010).
///
/// Source: GenICam SFNC 2.7, chapter "Chunk data control" (ChunkTimestamp: at the start of the frame,
/// ChunkExposureTime: us).
class AravisChunks {
 public:
  struct Values {
    std::optional<Duration> begin;
    std::optional<Duration> exposure;
  };

  /// Enables the two chunks, as far as the camera has them. Call this before the stream is created, because images
  /// become larger. Null if the camera has neither or refuses.
  static std::unique_ptr<AravisChunks> turn_on(ArvCamera* camera);

  /// Disables chunk data, which another program may have enabled.
  static void turn_off(ArvCamera* camera);

  /// Reads the chunks of a complete image. A chunk that is missing in 3 images in a row is no longer read.
  Values read(ArvBuffer* buffer);

  /// The chunks that are read, such as "Timestamp, ExposureTime".
  std::string names() const;

 private:
  // The feature with a chunk's value; null once the chunk is no longer read.
  struct Chunk {
    ArvGcNode* node = nullptr;
    int missed = 0;  // consecutive images without the chunk
  };

  AravisChunks() = default;
  static void came(Chunk& chunk, bool whole);

  Chunk timestamp_, exposure_;
  double ns_per_tick_ = 1.0;
};

}  // namespace mocap::cameras
