#pragma once

#include <string>

#include "base/result.h"
#include "model/blob.h"
#include "module/recording_size.h"

namespace mocap {

/// Writes the blobs of all cameras to a file.
///
/// One thread owns a BlobWriter and makes all calls.
class BlobWriter {
 public:
  virtual ~BlobWriter() = default;

  /// Writes one image's blobs. The frames of one camera come in the order of their exposure.
  virtual Status write(const BlobFrame& frame) = 0;

  /// Path of the recording; constant.
  virtual std::string path() const = 0;

  /// Size of the recording so far.
  virtual RecordingSize size() const = 0;

  /// Passes everything to the operating system and ends the file; `write` must not be called afterwards.
  virtual Status finish() = 0;
};

}  // namespace mocap
