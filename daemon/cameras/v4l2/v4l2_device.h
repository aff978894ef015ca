#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>

#include "base/result.h"

namespace mocap::cameras {

/// The opened device node of a camera, and its requests with their errors, which name the camera and the node. One
/// thread makes all calls.
class V4l2Device {
 public:
  /// `name`: of the camera.
  explicit V4l2Device(std::string name) : name_(std::move(name)) {}
  ~V4l2Device() { close(); }
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  /// Fails with NotFound, Busy, Io and Unsupported (a node that does not capture video by streaming).
  Status open(const std::filesystem::path& path);
  void close() noexcept;
  bool is_open() const noexcept { return handle_ >= 0; }
  int handle() const noexcept { return handle_; }
  const std::string& name() const noexcept { return name_; }
  /// The node of the last `open`.
  const std::filesystem::path& path() const noexcept { return path_; }

  /// Calls ioctl, again if a signal interrupts it. Returns 0 or errno.
  int call(unsigned long request, void* argument) const;
  /// Sets a control (V4L2_CID_...) to a value in the driver's unit. Fails with Unsupported (no such control) and
  /// InvalidArgument (out of its range); `what` names it.
  Status set_control(const char* what, std::uint32_t control, double value) const;
  /// The formats that the device offers, as text.
  std::string offered_formats() const;

  Error error(ErrorCode code, const std::string& what) const;
  /// The error of a request that failed with an errno.
  Error failed(const char* request, int reason) const;

 private:
  static constexpr int kNone = -1;

  std::string name_;
  std::filesystem::path path_;
  int handle_ = kNone;
};

}  // namespace mocap::cameras
