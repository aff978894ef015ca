#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cameras/camera_settings.h"
#include "model/camera_model.h"

namespace mocap::cameras {

/// A device on the USB, as the kernel tells it.
struct UsbDevice {
  std::filesystem::path folder;  ///< below /sys
  std::string manufacturer;
  std::string product;
  std::string serial;
  double speed_mbps = 0.0;   ///< of its own link, Mbit/s
  std::string bus;           ///< usb2: the root hub; devices of one share what it gives
  std::string controller;    ///< 0000:00:14.0
  double bus_mbps = 0.0;     ///< of the root hub, Mbit/s
  bool usb3_vision = false;  ///< has USB3 Vision's interfaces
  bool uvc = false;          ///< has those of a camera that V4L2 shows
  /// What the controller's own link to the processor gives for all its buses, MB/s; 0 where that is not told.
  double pcie_mb_per_s = 0.0;
};

/// All that is plugged in, from below `sys`; without hubs of the machine itself.
std::vector<UsbDevice> list_usb_devices(const std::filesystem::path& sys = "/sys");

/// What images really get of a link, MB/s: what is left when coding, packets and controllers have taken theirs.
double usable_mb_per_s(double speed_mbps);

/// What one camera sends, MB/s; nothing where its settings do not tell. `model` is its entry of the rig, for the size
/// where the settings leave it to the camera. Of MJPEG, which has no size, what two bits a pixel take.
std::optional<double> needed_mb_per_s(const CameraSettings& camera, const CameraModel* model);

/// One bus of a controller, and what its cameras ask of it.
struct UsbLoad {
  std::string bus;
  std::string controller;
  double given_mb_per_s = 0.0;
  double needed_mb_per_s = 0.0;
  std::vector<std::string> cameras;  ///< "cam1 36.9", MB/s; "cam2 ?" where that is not told
  /// Of what is narrower than the bus and too narrow for its cameras: a camera's own port or cable, a hub that several
  /// share, the controller's link to the processor.
  std::vector<std::string> slow;

  bool too_much() const { return needed_mb_per_s > given_mb_per_s || !slow.empty(); }
  std::string text() const;
};

/// The cameras that are plugged in, a line for each bus, whatever a configuration says of them: "usb2 of controller
/// 0000:00:14.0 gives 400 MB/s, shared by A1 and A2".
std::vector<std::string> usb_buses_of_cameras(const std::filesystem::path& sys = "/sys");

/// What the configured cameras that are plugged in ask of each bus. Reads /sys, opens nothing.
std::vector<UsbLoad> usb_loads(const std::vector<CameraSettings>& cameras, const Rig& rig,
                               const std::filesystem::path& sys = "/sys");

}  // namespace mocap::cameras
