#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/time.h"

typedef struct _ArvBuffer ArvBuffer;  // NOLINT(bugprone-reserved-identifier): Aravis's own names, for pointers only
typedef struct _ArvCamera ArvCamera;  // NOLINT(bugprone-reserved-identifier)
typedef struct _ArvGcNode ArvGcNode;  // NOLINT(bugprone-reserved-identifier)

namespace mocap::cameras {

/// What a camera writes behind each image about it (GenICam's chunk data): when its exposure began, by the camera's own
/// clock, and how long it was. One thread, while the camera is open.
///
/// Not by Aravis's ArvChunkParser: it reads the camera's description anew, and two that do so at once break each other.
///
/// Source: GenICam SFNC 2.7, chapter "Chunk data control" (ChunkTimestamp: at the start of the frame,
/// ChunkExposureTime: us).
class AravisChunks {
 public:
  struct Told {
    std::optional<Duration> begin;
    std::optional<Duration> exposure;
  };

  /// Turns on what the camera has of the two, before its stream is made: images become larger. Null where it has none
  /// or refuses.
  static std::unique_ptr<AravisChunks> turn_on(ArvCamera* camera);

  /// Turns chunk data off again where a program before turned it on.
  static void turn_off(ArvCamera* camera);

  /// Of a whole image. A chunk that does not come is no longer asked for.
  Told read(ArvBuffer* buffer);

  /// Such as "Timestamp, ExposureTime".
  std::string names() const;

 private:
  // A feature whose value is in the image, as long as it comes.
  struct Chunk {
    ArvGcNode* node = nullptr;
    int missed = 0;  // in a row
  };

  AravisChunks() = default;
  static void came(Chunk& chunk, bool whole);

  Chunk timestamp_, exposure_;
  double ns_per_tick_ = 1.0;
};

}  // namespace mocap::cameras
