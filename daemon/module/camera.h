#pragma once

#include <cstdint>
#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "model/frame.h"

namespace mocap {

/// Exposure and gain of a camera. An absent value is left as it is.
struct CameraAdjustment {
  std::optional<double> exposure_us = std::nullopt;
  std::optional<double> gain_db = std::nullopt;
};

/// A source of images. A new make of camera implements start(), next() and stop(), and is added in one line of
/// cameras/open_camera.cpp.
///
/// One thread owns a Camera and makes all calls.
class Camera {
 public:
  virtual ~Camera() = default;

  /// Starts delivery. Fails with NotFound, Busy, Unsupported or Io; may be called again after stop(). Fails with
  /// Timeout if the search for the device takes longer than some tenths of a second: the search continues, and the next
  /// call returns its result.
  virtual Status start() = 0;

  /// Waits at most `patience` for the next image. Fails with Timeout if no image came, with DeviceLost if no image will
  /// come until start() is called again, with Io if an image arrived incomplete (the next one may be complete), and
  /// with EndOfStream at the end of a finite source. The pixels are valid until the next call of any method. The
  /// Timeout error has no message, so that waiting does not allocate.
  virtual Result<Frame> next(Duration patience) = 0;

  /// The current exposure and gain that adjust() can change; nothing if the driver cannot change them.
  virtual std::optional<CameraAdjustment> adjustment() const { return std::nullopt; }

  /// Changes exposure and gain. The values also apply after the next start(), which fails if the camera rejects them.
  /// Fails with Unsupported if the driver cannot change them.
  virtual Status adjust(const CameraAdjustment& /*to*/) {
    return Error{ErrorCode::Unsupported, "its driver cannot change exposure or gain while it runs"};
  }

  /// Whether the images have pixels; without them no mask can be learned here.
  virtual bool has_pixels() const { return true; }

  /// Ends delivery. Does nothing if already stopped.
  virtual void stop() noexcept = 0;
};

}  // namespace mocap
