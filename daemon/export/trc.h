#pragma once

#include "export/clip/clip.h"
#include "export/sink.h"
#include "export/write_options.h"

namespace mocap::exports {

/// Writes the markers of a clip as TRC, as OpenSim reads it. A missing marker is three empty cells. The time of the
/// first frame is 0; OrigDataStartFrame is its number in the take, from 1. White space in a label becomes "_".
///
/// Fails with InvalidArgument if there is no marker.
///
/// Source: OpenSim documentation, "Marker (.trc) Files".
Status write_trc(const Clip& clip, const WriteOptions& options, const Sink& sink);

}  // namespace mocap::exports
