#pragma once

#include <cstddef>

namespace mocap {

// The design bounds. A configuration with more cameras, subjects, bones or labels is refused. Of the blobs of an image
// the largest are kept, and the others are counted. With kMaxMarkers 3D tracks no new track starts.
inline constexpr std::size_t kMaxCameras = 64;
inline constexpr std::size_t kMaxBlobs = 512;     ///< in one image
inline constexpr std::size_t kMaxMarkers = 1024;  ///< in one set, labelled or not
inline constexpr std::size_t kMaxSubjects = 16;
inline constexpr std::size_t kMaxBones = 128;   ///< of one subject
inline constexpr std::size_t kMaxLabels = 128;  ///< markers of one subject

}  // namespace mocap
