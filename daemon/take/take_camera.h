#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "model/ids.h"
#include "module/blob_tracker.h"
#include "module/camera.h"
#include "module/detector.h"

namespace mocap::take {

struct TakeCameraSettings {
  std::filesystem::path file;  ///< the take
  double speed = 1.0;          ///< 1: recorded pace; 0: as fast as possible
  bool loop = false;
};

/// Plays the images of one camera of a take. A take has blobs and no pixels, so each image is black, and the detector
/// and the 2D tracker of this camera give the recorded blobs with their recorded 2D tracks.
///
/// Numbers and times are the recorded ones, at any speed; with `loop` they continue to increase, and each pass begins
/// one mean period after the last image. start() fails with NotFound (no such file, or the take has no camera of this
/// name; the message lists its cameras) and as TakeReader::open does. A damaged image is an Io error of its frame.
class TakeCamera : public Camera {
 public:
  /// The blobs of the last image that next() returned, with their 2D tracks.
  virtual const Blobs& blobs() const = 0;
};

std::unique_ptr<TakeCamera> make_take_camera(CameraId id, std::string name, TakeCameraSettings settings);

/// The camera outlives its detectors.
std::unique_ptr<Detector> make_take_detector(const TakeCamera& camera);

/// Leaves the 2D tracks as they are.
std::unique_ptr<BlobTracker> make_take_tracker();

}  // namespace mocap::take
