#pragma once

namespace mocap::offline {

/// The positions that two passes give one marker in the same images differ by less than this: markers are 14 mm wide.
inline constexpr double kSameMarker_m = 0.010;
/// Smallest number of labels that both passes measured, for a comparison of the passes.
inline constexpr int kFewestLabels = 4;
/// The passes agree about a subject if at least this share of these labels is within kSameMarker_m.
inline constexpr double kAgreeingShare = 0.8;

}  // namespace mocap::offline
