#pragma once

#include <cstddef>

namespace mocap {

// The design bounds. Over a bound the largest items are kept; the others are dropped and counted.
inline constexpr std::size_t kMaxCameras = 64;
inline constexpr std::size_t kMaxBlobs = 512;     ///< in one image
inline constexpr std::size_t kMaxMarkers = 1024;  ///< in one set, labelled or not
inline constexpr std::size_t kMaxSubjects = 16;
inline constexpr std::size_t kMaxBones = 128;   ///< of one subject
inline constexpr std::size_t kMaxLabels = 128;  ///< markers of one subject

}  // namespace mocap
