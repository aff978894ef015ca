#pragma once

#include <cstddef>
#include <cstdint>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// Points in a SearchReport: as many as a search for a calibration pose uses.
inline constexpr std::size_t kMaxReportPoints = 160;

/// The blobs of one camera in one set.
struct SearchView {
  CameraId camera;
  std::uint32_t blobs = 0;
  std::uint32_t in_markers = 0;  ///< blobs that are views of a triangulated marker
};

/// The evidence on which the search for one missing subject works in one set. The fusion thread fills it in; it gives
/// no reason yet (explain/README.md).
struct SearchReport {
  SubjectId subject;
  bool is_fitted = false;  ///< the body is known: it is searched for in any pose
  Timestamp at;            ///< exposure of the set
  /// World positions: confirmed tracks without a label, then stationary candidate points.
  BoundedVector<WorldPoint, kMaxReportPoints> points;
  std::uint32_t confirmed = 0;  ///< confirmed tracks among `points`, at the front
  std::uint32_t still = 0;      ///< confirmed tracks that have been stationary long enough for a T-pose
  BoundedVector<SearchView, kMaxCameras> views;  ///< in the order of CameraId; a camera without an image is absent
};

}  // namespace mocap
