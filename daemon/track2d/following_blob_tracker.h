#pragma once

#include <cstddef>
#include <memory>

#include "model/bounds.h"
#include "module/blob_tracker.h"
#include "track2d/track_blobs_settings.h"

namespace mocap::track2d {

/// Makes the tracker of one camera, for images of `max_blobs` at most: each blob's `track` names the confirmed track
/// that it belongs to; the blobs of tentative tracks stay without, and so do those of markers that cannot be told apart
/// for a while (BlobPair). The assignment is the best in sum over all tracks
/// and blobs within their gates. Settings are in their ranges. `track` does not allocate. It implements
/// BlobTrackInspection too.
std::unique_ptr<BlobTracker> make_blob_tracker(const TrackBlobsSettings& settings, std::size_t max_blobs = kMaxBlobs);

}  // namespace mocap::track2d
