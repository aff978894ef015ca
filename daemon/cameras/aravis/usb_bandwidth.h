#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera_settings.h"
#include "model/camera_model.h"

namespace mocap::cameras {

/// A device on the USB, as sysfs describes it.
struct UsbDevice {
  std::filesystem::path folder;  ///< below /sys
  std::string manufacturer;
  std::string product;
  std::string serial;
  double speed_mbps = 0.0;   ///< of its own link, Mbit/s
  std::string bus;           ///< root hub, such as usb2; its devices share its bandwidth
  std::string controller;    ///< 0000:00:14.0
  double bus_mbps = 0.0;     ///< of the root hub, Mbit/s
  bool usb3_vision = false;  ///< has the interfaces of USB3 Vision
  bool uvc = false;          ///< has the interfaces of a video camera (UVC), which V4L2 serves
  /// Usable bandwidth of the controller's PCIe link, shared by all its buses, MB/s; 0 if unknown.
  double pcie_mb_per_s = 0.0;
};

/// All connected devices in the sysfs folder `sys`, without root hubs.
std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& sys = "/sys");

/// Bandwidth of a link that is left for images after coding, packet headers and controller limits, MB/s. `speed_mbps`
/// is the signalling rate.
double usable_mb_per_s(double speed_mbps);

/// Bandwidth that one camera needs, MB/s; absent if its settings do not determine it. `model` is its entry in the rig,
/// which gives the image size if the settings do not; may be null. MJPEG is counted as 2 bits per pixel.
std::optional<double> needed_mb_per_s(const CameraSettings& camera, const CameraModel* model);

/// Bandwidth of one bus of a controller, and the bandwidth that its cameras need.
struct UsbLoad {
  std::string bus;
  std::string controller;
  double given_mb_per_s = 0.0;
  double needed_mb_per_s = 0.0;
  std::vector<std::string> cameras;  ///< "cam1 36.9", MB/s; "cam2 ?" if unknown
  /// Links that are narrower than the bus and too narrow for their cameras: a camera's own port or cable, a hub that
  /// several cameras share, the PCIe link of the controller.
  std::vector<std::string> slow;

  bool too_much() const { return needed_mb_per_s > given_mb_per_s || !slow.empty(); }
  std::string text() const;
};

/// One line for each bus with connected cameras, independent of a configuration: "usb2 of controller 0000:00:14.0 gives
/// 400 MB/s, shared by A1 and A2".
std::vector<std::string> usb_buses_of_cameras(const std::filesystem::path& sys = "/sys");

/// The load of each bus by the configured cameras that are connected. Reads sysfs; opens V4L2 nodes only to identify a
/// camera by its serial number or bus.
std::vector<UsbLoad> usb_loads(const std::vector<CameraSettings>& cameras, const Rig& rig,
                               const std::filesystem::path& sys = "/sys");

}  // namespace mocap::cameras
