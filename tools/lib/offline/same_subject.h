#pragma once

namespace mocap::offline {

/// Two labels of one marker in the same images, which two passes gave, are nearer than this: markers are 14 mm wide.
inline constexpr double kSameMarker_m = 0.010;
/// Labels measured by both passes from which their agreement about a subject is judged.
inline constexpr int kFewestLabels = 4;
/// Of these labels, the share within kSameMarker_m if both passes agree.
inline constexpr double kAgreeingShare = 0.8;

}  // namespace mocap::offline
