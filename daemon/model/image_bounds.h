#pragma once

namespace mocap {

/// Largest width and height of an image that a file or a peer may name, as in the settings of the cameras: 8-bit grey
/// has at most 256 MiB.
inline constexpr int kMaxImageSide_px = 16384;

}  // namespace mocap
