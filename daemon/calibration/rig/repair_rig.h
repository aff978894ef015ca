#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/image_cells.h"
#include "model/blob.h"
#include "model/camera_model.h"
#include "model/ids.h"

namespace mocap::calibration {

/// A blob that an associated marker has in one camera.
struct MarkerView {
  CameraId camera;
  Blob blob;
};

/// A marker that was triangulated from three cameras or more.
struct TriangulatedMarker {
  WorldPoint position;
  std::vector<MarkerView> views;
};

/// The triangulated markers of one instant.
struct TriangulatedSet {
  Timestamp exposed_at;
  std::vector<TriangulatedMarker> markers;
};

/// The deviation of a camera from the pose that the rig gives it, measured from the views of the other cameras.
struct CameraDeviation {
  bool drifted = false;
  double off_px = 0.0;                ///< rms over its views that a motion of the camera explains
  CameraFromWorld camera_from_world;  ///< estimated pose
};

/// A recording of moving markers, as repair_rig reads it. The implementation runs the daemon's pipeline, which this
/// folder may not include. Every call gives the same result for the same arguments.
class MarkerRecording {
 public:
  virtual ~MarkerRecording() = default;

  /// Associates and triangulates all instants with the poses of `rig`, without the views of the `excluded` cameras (by
  /// CameraId; empty: none), and calls `visit` for each instant in the order of time.
  virtual void triangulate(const Rig& rig, const std::vector<bool>& excluded,
                           const std::function<void(const TriangulatedSet&)>& visit) const = 0;
  /// The blobs of the image of `camera` at an instant; empty if it has no image then. Valid as long as the recording.
  virtual std::span<const Blob> blobs(CameraId camera, Timestamp exposed_at) const = 0;
  /// The deviation of each camera, by CameraId, over the whole recording.
  virtual std::vector<CameraDeviation> deviations(const Rig& rig) const = 0;
};

/// A camera whose pose was estimated again.
struct RepairedCamera {
  std::string name;
  double rotated_rad = 0.0;
  double moved_m = 0.0;
};

/// Fewer views of markers do not determine the pose of a camera. Chosen by hand; not yet measured.
inline constexpr std::size_t kMinRepairViews = 100;

/// A camera whose pose was not changed, because its views of markers are too few or cover too little of its image, or
/// because too few of them are left without the views of such cameras.
struct KeptCamera {
  std::string name;
  std::size_t views = 0;  ///< of markers that three cameras or more see, kept cameras included
  std::size_t cells = 0;  ///< of its image that these views cover, of kImageCells x kImageCells

  /// Whether its views would suffice if no other camera were kept.
  bool is_sufficient() const { return views >= kMinRepairViews && cells >= kMinCoveredCells; }
};

/// Why a camera was kept, such as "only 50 views of markers that three cameras see, expected at least 100".
std::string reason_of(const KeptCamera& camera);

struct RepairedRig {
  Rig rig;
  std::vector<RepairedCamera> cameras;  ///< in the order of their repair
  std::vector<KeptCamera> kept;         ///< not all cameras; first those that are not sufficient
  double before_px = 0.0;               ///< robust rms per axis, after the repair of single cameras
  double after_px = 0.0;                ///< after the adjustment of all cameras
};

/// Repairs a rig of which single cameras were bumped: estimates the pose of one drifted camera after the other by
/// resection from markers that the other cameras triangulate, then adjusts the extrinsics of all cameras (refine_rig).
///
/// `deviations`: of `before`, by CameraId. With at least four undrifted cameras, all drifted cameras are excluded from
/// the triangulation at once. With fewer, leave-one-out validation finds the bumped camera: the one without which the
/// others agree best (decisions/0005).
///
/// Fails with InvalidArgument and an advice if the markers are too few or cover too little of all images, if the views
/// of a bumped camera do not determine its pose to 5 mm and 0.1 degrees, if half of the cameras or more drifted, if no
/// bumped camera can be found, or if a camera still deviates afterwards (its lens has changed).
Result<RepairedRig> repair_rig(const MarkerRecording& recording, const Rig& before,
                               std::vector<CameraDeviation> deviations, int threads);

}  // namespace mocap::calibration
