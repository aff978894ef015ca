#pragma once

#include <cstdint>
#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "model/frame.h"

namespace mocap {

/// A source of images. A new kind of camera implements these three methods and one line in
/// cameras/open_camera.cpp; nothing else changes.
///
/// One thread owns a Camera and makes all calls.
class Camera {
 public:
  virtual ~Camera() = default;

  /// Begins to deliver. Fails with NotFound, Busy, Unsupported or Io; may be called again after stop(). Fails with
  /// Timeout when it waited some tenths of a second and is still looking for the device: call again for the answer.
  virtual Status start() = 0;

  /// Waits for the next image, `patience` at most. Fails with Timeout when none came, with DeviceLost when none will
  /// come until start() is called again, with Io when one came broken (the next may be whole), and with EndOfStream
  /// when a finite source is through. The pixels are borrowed: they stay valid until the next call of any method. A
  /// Timeout bears no message, so that waiting allocates nothing.
  virtual Result<Frame> next(Duration patience) = 0;

  /// Sets what is present while it delivers; images that are on their way may be of before. Fails with Unsupported
  /// where the driver cannot, with InvalidArgument out of the camera's range, and with Io.
  virtual Status adjust(std::optional<double> /*exposure_us*/, std::optional<double> /*gain_db*/) {
    return Error{ErrorCode::Unsupported, "its driver cannot change exposure or gain while it runs"};
  }

  /// Ends delivery. Harmless when already stopped.
  virtual void stop() noexcept = 0;
};

}  // namespace mocap
