#pragma once

#include <functional>
#include <string>
#include <vector>

#include "export/clip/clip.h"
#include "export/clip/clip_builder.h"
#include "take/recordings/snapshot_reader.h"

namespace mocap::exports {

/// Reads the snapshots and the marks of a recording into a builder. `progress` is called from time to time with the
/// share that was read, 0 to 1. Fails as SnapshotReader::next and ClipBuilder do.
Status read_into(ClipBuilder& builder, take::SnapshotReader& recording, const std::function<void(double)>& progress);

}  // namespace mocap::exports
