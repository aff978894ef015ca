#pragma once

#include <vector>

#include "model/camera_model.h"
#include "settings/rig/rig_text.h"

namespace mocap::settings {

/// One of the two lists of masks that a camera has.
struct MaskKind {
  const char* word;
  const char* key;  ///< in the camera's table
  std::vector<MaskPolygon> CameraModel::*of;
  const char* remedy;  ///< how to make the masks again
};

inline constexpr MaskKind kDrawnMasks{"drawn", kDrawnMask, &CameraModel::masks, "draw them again (mocapctl mask draw)"};
inline constexpr MaskKind kLearntMasks{"learnt", kLearntMask, &CameraModel::learnt_masks,
                                       "learn them again (mocapctl mask learn)"};

}  // namespace mocap::settings
