#pragma once

#include <cstdint>
#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "model/frame.h"

namespace mocap {

/// How much light a camera takes; absent: as the camera has it.
struct CameraAdjustment {
  std::optional<double> exposure_us = std::nullopt;
  std::optional<double> gain_db = std::nullopt;
};

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

  /// What can be changed of it; nothing where its driver cannot.
  virtual std::optional<CameraAdjustment> adjustment() const { return std::nullopt; }

  /// Holds from the next start() on, which fails if the camera cannot. Fails with Unsupported where the driver cannot.
  virtual Status adjust(const CameraAdjustment& /*to*/) {
    return Error{ErrorCode::Unsupported, "its driver cannot change exposure or gain while it runs"};
  }

  /// Ends delivery. Harmless when already stopped.
  virtual void stop() noexcept = 0;
};

}  // namespace mocap
