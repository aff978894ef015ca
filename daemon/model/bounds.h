#pragma once

#include <cstddef>

namespace mocap {

// The design bounds. A configuration over kMaxCameras, kMaxSubjects, kMaxBones or kMaxLabels is refused.
inline constexpr std::size_t kMaxCameras = 64;
inline constexpr std::size_t kMaxBlobs = 512;     ///< in one image; the largest are kept, the others are counted
inline constexpr std::size_t kMaxMarkers = 1024;  ///< labelled or not; with as many 3D tracks no new one starts
inline constexpr std::size_t kMaxSubjects = 16;
inline constexpr std::size_t kMaxBones = 128;   ///< of one subject
inline constexpr std::size_t kMaxLabels = 128;  ///< markers of one subject

}  // namespace mocap
