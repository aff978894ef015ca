#pragma once

#include "base/result.h"
#include "mocap/v1/take.pb.h"
#include "model/blob.h"

namespace mocap::wire {

/// Encodes without loss. A reused message keeps its memory.
void encode(const BlobFrame& from, v1::CameraBlobs& into);

/// Decodes a message of an untrusted file or peer. Fails with InvalidArgument if columns differ in length, there are
/// more than kMaxBlobs blobs or kMaxCameras cameras, or a position (at most 1e6 px) or sigma is not a valid number.
Result<BlobFrame> decode(const v1::CameraBlobs& from);

/// The same without a copy of the blobs. After a failure `into` holds no blobs.
Status decode(const v1::CameraBlobs& from, BlobFrame& into);

}  // namespace mocap::wire
