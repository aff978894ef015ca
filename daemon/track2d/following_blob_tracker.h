#pragma once

#include <cstddef>
#include <memory>

#include "model/bounds.h"
#include "module/blob_tracker.h"
#include "track2d/track_blobs_settings.h"

namespace mocap::track2d {

/// Makes the tracker of one camera, for images with at most `max_blobs` blobs. The tracker sets `track` of each blob to
/// the id of its confirmed track; blobs of tentative tracks and of ambiguous pairs (BlobPair) get no id. The assignment
/// has the least total cost over all tracks and blobs within their gates. The settings are in their ranges. `track`
/// does not allocate. The tracker also implements BlobTrackInspection.
std::unique_ptr<BlobTracker> make_blob_tracker(const TrackBlobsSettings& settings, std::size_t max_blobs = kMaxBlobs);

}  // namespace mocap::track2d
