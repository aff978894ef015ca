#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "base/time.h"

namespace mocap::cameras {

/// A feature of a camera by the name that its maker gave it (GenICam), and its value as text.
using Feature = std::pair<std::string, std::string>;

/// A GigE Vision or USB3 Vision camera. Exactly one of `serial`, `device_name`, `address` and `mac` says which. What is
/// not set stays as the camera has it.
struct AravisSettings {
  std::string serial;       ///< as printed on the camera
  std::string device_name;  ///< the user-defined name in the camera
  std::string address;      ///< IP address
  std::string mac;          ///< of its network card, as 00:11:1c:f5:a0:01
  std::string pixel_format = "Mono8";
  std::optional<int> x_px, y_px, width_px, height_px;  ///< region of the sensor
  std::optional<double> rate_hz;
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  std::string trigger = "free_run";      ///< free_run, software, action, or a line: Line0, Line1, ...
  std::optional<int> packet_size_bytes;  ///< empty: negotiated
  bool packet_socket = true;             ///< off on loopback, where it receives nothing
  int stream_buffers = 16;
  double delivery_us = 0.0;  ///< least time from the end of the exposure to its first byte here; for `estimated`
  /// How a stamp of the camera becomes the host's time. estimated: from the times of receipt (offset, drift). utc: the
  /// camera counts nanoseconds of UTC as this host does (PTP, or a camera simulated on this host).
  std::string clock = "estimated";
  bool ptp = false;    ///< the camera keeps PTP time (IEEE 1588): enabled, and its role waited for
  bool chunks = true;  ///< takes the exposure's begin and length from each image where the camera can write them there
  /// What instant the camera stamps: start, middle or end of the exposure. Only `utc` looks at it, and exposures that
  /// vary: `estimated` knows the end of the exposure by the receipt, whatever is stamped. Chunks tell the start.
  std::string stamps = "start";
  std::vector<Feature> features;  ///< any others, set in this order after all of the above
};

/// A camera of the Linux kernel's video API. Exactly one of `device`, `serial` and `bus` says which.
struct V4l2Settings {
  std::filesystem::path device;       ///< /dev/video0, or a stable link under /dev/v4l/by-path
  std::string serial;                 ///< of the USB device
  std::string bus;                    ///< where it is plugged in, as the driver tells it: usb-0000:00:14.0-2
  std::string pixel_format = "GREY";  ///< GREY, Y10, Y12, GRBG, RGGB, GBRG, BA81, YUYV, NV12, MJPEG
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 30.0;
  std::optional<double> exposure_us;
  std::optional<double> gain;  ///< the driver's own unit
  int buffers = 4;
};

/// Images from files: a folder of numbered images or a video, with timestamps.csv beside them.
struct ReplaySettings {
  /// The camera's own folder (numbered images or one video file, and timestamps.csv), or the folder in which that
  /// folder stands under the camera's name.
  std::filesystem::path folder;
  double rate_hz = 60.0;  ///< where there is no timestamps.csv
  double speed = 1.0;     ///< 1: recorded pace, 2: twice it, 0: as fast as possible
  bool loop = false;
};

/// A camera of the simulated volume, in this process.
struct SyntheticSettings {
  std::string motion = "tpose:2,walk";  ///< as mocap-sim's --motion
  std::filesystem::path marker_set;     ///< worn by the simulated subject
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 60.0;
  double exposure_us = 500.0;
  double noise_grey = 2.0;  ///< read noise, standard deviation, grey levels
  std::uint64_t seed = 1;
  double speed = 1.0;  ///< as in replay
  Timestamp epoch;     ///< exposures are whole periods after it and the motion begins there; one for all cameras
};

/// One [[camera]] of the configuration.
struct CameraSettings {
  std::string name;  ///< in the log, in the rig and on the wire
  std::variant<AravisSettings, V4l2Settings, ReplaySettings, SyntheticSettings> driver;
  // For who detects in its images, no matter of the camera itself; empty: as for all cameras.
  std::optional<double> threshold = std::nullopt;  ///< grey level of 255; 0: from the noise
  std::optional<double> low_threshold = std::nullopt;
};

}  // namespace mocap::cameras
