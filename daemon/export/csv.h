#pragma once

#include "export/clip/clip.h"
#include "export/sink.h"
#include "export/write_options.h"

namespace mocap::exports {

/// Writes markers and bones of a clip as CSV (RFC 4180, lines end with \n): one line of column names with units, then a
/// line for each frame.
///
/// Columns: `frame` (number in the take, from 0), `time_s` (after the first frame), `timecode` if the take has one; of
/// each marker `LABEL.x_mm` y z, `LABEL.state` and `LABEL.residual_mm`; of each bone `bone:NAME.x_mm` y z (its joint in
/// the world), `.qx` `.qy` `.qz` `.qw` (rotation from the bone's frame to the world) and `.state`. A state is
/// `measured`, `filled` or `lost`. Cells of what is lost are empty.
Status write_csv(const Clip& clip, const WriteOptions& options, const Sink& sink);

}  // namespace mocap::exports
