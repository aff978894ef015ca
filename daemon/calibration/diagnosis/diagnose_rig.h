#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/wand/wand_recording.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// The cause why the blobs of a camera are no views of the points that the other cameras see.
enum class RigFault {
  Exchanged,        ///< two cameras have each other's images
  UpsideDown,       ///< the image is rotated by 180 degrees
  MirroredSides,    ///< left and right of the image are exchanged
  MirroredHeights,  ///< top and bottom of the image are exchanged
  OneFrameLate,     ///< its exposure times are one frame period too late
  OneFrameEarly,
  OtherPose,    ///< turned or moved
  OtherLens,    ///< the focal length is not that of the rig
  Unexplained,  ///< none of these
  OtherRig,     ///< most cameras are unexplained
};

/// A camera that does not fit the rig.
struct RigFinding {
  RigFault fault = RigFault::Unexplained;
  std::size_t camera = 0;  ///< index in the rig
  std::size_t other = 0;   ///< Exchanged: the other camera
  /// Exchanged: other pairs that explain the blobs as well, because the rig is symmetric.
  std::vector<std::pair<std::size_t, std::size_t>> alternatives = {};
  double share_before = 0.0;  ///< share of the markers of the other cameras that this camera sees, as the rig says
  double share_after = 0.0;   ///< the same under the hypothesis
  CameraModel model = {};     ///< OtherPose, OtherLens: the fitted camera
  double turned_rad = 0.0;    ///< OtherPose
  double moved_m = 0.0;       ///< OtherPose
  double focal_ratio = 1.0;   ///< OtherLens: fitted focal length over that of the rig
  double statistic = 0.0;     ///< standard normal, of the hypothesis that the fault does not explain the blobs better
};

struct RigDiagnosis {
  std::vector<RigFinding> findings;       ///< empty: no fault was found
  std::vector<double> share;              ///< by camera: of the markers of the other cameras, as the rig says
  std::vector<std::size_t> undetermined;  ///< cameras with too few common markers for a judgement
};

/// With fewer cameras, no points of the others exist that a camera could be compared with.
inline constexpr std::size_t kMinDiagnosedCameras = 3;

/// Called with the hypotheses that are tested next: "camera cam3".
using DiagnosisProgress = std::function<void(const std::string& tested)>;

/// Finds the cameras whose blobs do not fit the rig, and why. Each hypothesis is one of RigFault; it is tested by the
/// likelihood that the blobs of a camera are views of the points on which the other cameras agree. The best hypothesis
/// that explains the blobs significantly better than the rig (Vuong's test, kSignificant) is applied; then the next
/// fault is searched.
///
/// `recording`: blobs of moving markers, by camera of the rig. Markers that do not move carry little evidence. A rig
/// needs three cameras; with two, both are undetermined. Deviations below kReprojectionGate_px are no fault here: the
/// drift watch measures them. The work is bounded: fewer instants for many blobs, the likeliest exchanges only.
/// `progress` is called before each group of hypotheses. The same input gives the same result.
RigDiagnosis diagnose_rig(const Rig& rig, const Take& recording, const DiagnosisProgress& progress = {});

/// One sentence: the fault and the remedy. "cam2 and cam3 fit if exchanged: ...".
std::string sentence_of(const RigFinding& finding, const Rig& rig);

}  // namespace mocap::calibration
