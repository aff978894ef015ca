#pragma once

#include <cstddef>

#include "export/clip/clip.h"
#include "export/sink.h"
#include "export/write_options.h"

namespace mocap::exports {

/// The most events in a file.
inline constexpr std::size_t kMaxC3dEvents = 255;

/// Writes the markers of a clip as C3D: Intel byte order, floating-point positions.
///
/// A measured marker has its residual and camera bits, a filled one neither (both 0), a missing one the residual -1.
/// The clip knows how many cameras saw a marker, not which: n cameras, at most 7, are the first n bits. The names
/// of events, the take and its producer are cut to 127 bytes, those of events in the header to 4.
///
/// Fails with InvalidArgument if there is no marker, if there are more than 65535 markers or 255 events, if another
/// name has more than 127 bytes (cut names could be the same), or if the names do not fit into the parameter section.
///
/// Source: "The C3D File Format" (c3d.org).
Status write_c3d(const Clip& clip, const WriteOptions& options, const Sink& sink);

}  // namespace mocap::exports
