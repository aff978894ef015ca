#include "cameras/aravis/usb_bandwidth.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <map>
#include <utility>

#include "base/list_folder.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/v4l2/v4l2_discovery.h"
#include "cameras/v4l2/v4l2_settings.h"

namespace mocap::cameras {
namespace {

namespace fs = std::filesystem;

std::string text_in(const fs::path& file) {
  std::string text;
  std::ifstream from(file);
  std::getline(from, text);
  return text;
}

bool is_root_hub(const std::string& name) { return name.starts_with("usb"); }

// The folder of an interface is in that of its device and is named 2-1:1.0. USB3 Vision has class ef, subclass 05; UVC
// has class 0e.
void find_interfaces(UsbDevice& device) {
  const std::string begin = device.folder.filename().string() + ":";
  for (const fs::path& interface : list_folder(device.folder).paths) {
    if (!interface.filename().string().starts_with(begin)) continue;
    const std::string kind = text_in(interface / "bInterfaceClass");
    if (kind == "ef" && text_in(interface / "bInterfaceSubClass") == "05") device.usb3_vision = true;
    if (kind == "0e") device.uvc = true;
  }
}

// PCIe codes 8 bits in 10 up to 5 GT/s and 128 bits in 130 above. Packets of 128 bytes leave about 85 %. Controllers
// inside the processor have no such link, or a link of width 0.
double usable_pcie_mb_per_s(const fs::path& controller) {
  const double gt_per_s = std::atof(text_in(controller / "current_link_speed").c_str());
  const double lanes = std::atof(text_in(controller / "current_link_width").c_str());
  const double coding = gt_per_s <= 5.0 ? 8.0 / 10.0 : 128.0 / 130.0;
  return 0.85 * 1e3 / 8.0 * gt_per_s * coding * lanes;
}

// The bus is the root hub: the first folder usbN on the path to the device. The controller is the parent of the root
// hub.
void find_bus(UsbDevice& device) {
  fs::path at = device.folder;
  while (at.has_relative_path() && !is_root_hub(at.filename().string())) at = at.parent_path();
  device.bus = at.filename().string();
  device.controller = at.parent_path().filename().string();
  device.bus_mbps = std::atof(text_in(at / "speed").c_str());
  device.pcie_mb_per_s = usable_pcie_mb_per_s(at.parent_path());
}

double bits_a_pixel(const std::string& format) {
  constexpr std::pair<const char*, double> kOthers[] = {
      {"Mono10", 16.0},       {"Mono12", 16.0},  {"Y10", 16.0},     {"Y12", 16.0},
      {"YUYV", 16.0},         {"Mono10p", 10.0}, {"Mono12p", 12.0}, {"Mono10Packed", 12.0},
      {"Mono12Packed", 12.0}, {"NV12", 12.0},    {"MJPEG", 2.0}};
  for (const auto& [name, bits] : kOthers) {
    if (format == name) return bits;
  }
  return 8.0;
}

double mb_per_s(double width_px, double height_px, const std::string& format, double rate_hz) {
  return 1e-6 / 8.0 * width_px * height_px * bits_a_pixel(format) * rate_hz;
}

const UsbDevice* device_of(const CameraSettings& camera, const std::vector<UsbDevice>& devices, const fs::path& sys) {
  if (const auto* aravis = camera.driver.as<AravisSettings>()) {
    const auto found = std::find_if(devices.begin(), devices.end(), [&](const UsbDevice& each) {
      return each.usb3_vision && !aravis->serial.empty() && each.serial == aravis->serial;
    });
    return found != devices.end() ? &*found : nullptr;
  }
  const auto* v4l2 = camera.driver.as<V4l2Settings>();
  if (v4l2 == nullptr) return nullptr;
  const Result<fs::path> node = find_video_node(*v4l2);
  std::error_code missing;
  if (!node) return nullptr;
  const fs::path real = fs::canonical(*node, missing);  // resolves a link under /dev/v4l
  const fs::path at = fs::canonical(sys / "class/video4linux" / real.filename() / "device", missing);
  const auto found = std::find_if(devices.begin(), devices.end(), [&](const UsbDevice& each) {
    return !missing && at.string().starts_with(each.folder.string() + "/");
  });
  return found != devices.end() ? &*found : nullptr;
}

// A link between cameras and their bus, or between the controller and the processor. All cameras beyond it share it.
struct Link {
  std::string what;  // "are plugged in at 480 Mbit/s"
  std::string bus;   // bus whose UsbLoad names the link
  double given_mb_per_s = 0.0;
  double needed_mb_per_s = 0.0;
  std::vector<std::string> cameras;

  std::string text() const {
    const std::string who =
        cameras.size() == 1 ? cameras.front() + " is" : fmt::format("{} are", fmt::join(cameras, " and "));
    return fmt::format("{} {}, which gives {:.0f} MB/s", who, what, given_mb_per_s);
  }
};

// Adds a camera to each link on its path: its own port, all hubs (each in the folder of the next one), and the
// controller.
void add_to_links(std::map<fs::path, Link>& links, const UsbDevice& device, const std::string& camera, double needed) {
  const auto add = [&](const fs::path& at, const std::string& what, double given) {
    Link& link = links.try_emplace(at, Link{what, device.bus, given, 0.0, {}}).first->second;
    link.needed_mb_per_s += needed;
    link.cameras.push_back(camera);
  };
  fs::path at = device.folder;
  for (; at.has_relative_path() && !is_root_hub(at.filename().string()); at = at.parent_path()) {
    const double speed_mbps = std::atof(text_in(at / "speed").c_str());
    const std::string hub = at == device.folder ? "" : fmt::format(" by hub {}", at.filename().string());
    add(at, fmt::format("plugged in{} at {:.0f} Mbit/s", hub, speed_mbps), usable_mb_per_s(speed_mbps));
  }
  if (device.pcie_mb_per_s > 0.0) {
    add(at.parent_path(), fmt::format("on controller {} with a narrow PCIe link", device.controller),
        device.pcie_mb_per_s);
  }
}

}  // namespace

std::vector<UsbDevice> list_usb_devices(const fs::path& sys) {
  std::vector<UsbDevice> devices;
  for (const fs::path& folder : list_folder(sys / "bus/usb/devices").paths) {
    const std::string name = folder.filename().string();
    if (is_root_hub(name) || name.find(':') != std::string::npos) continue;
    std::error_code gone;
    UsbDevice device;
    device.folder = fs::canonical(folder, gone);
    if (gone) continue;  // unplugged since the listing
    device.manufacturer = text_in(device.folder / "manufacturer");
    device.product = text_in(device.folder / "product");
    device.serial = text_in(device.folder / "serial");
    device.speed_mbps = std::atof(text_in(device.folder / "speed").c_str());
    find_interfaces(device);
    find_bus(device);
    devices.push_back(std::move(device));
  }
  return devices;
}

// USB 2: 13 packets of 512 bytes in 125 us are 53 MB/s; controllers reach about 40. USB 3 at 5 Gbit/s: 8 bits coded in
// 10 are 500 MB/s; packets and acknowledgements leave about 400. From 10 Gbit/s on: 128 bits coded in 132, of which
// about 90 % are usable.
double usable_mb_per_s(double speed_mbps) {
  if (speed_mbps < 480.0) return speed_mbps / 12.0;
  if (speed_mbps < 5000.0) return 40.0;
  return speed_mbps < 10000.0 ? 400.0 : 0.9 * speed_mbps / 8.0 * 128.0 / 132.0;
}

std::optional<double> needed_mb_per_s(const CameraSettings& camera, const CameraModel* model) {
  if (const auto* aravis = camera.driver.as<AravisSettings>()) {
    const int width_px = aravis->width_px.value_or(model != nullptr ? model->width_px : 0);
    const int height_px = aravis->height_px.value_or(model != nullptr ? model->height_px : 0);
    if (width_px <= 0 || height_px <= 0 || !aravis->rate_hz) return std::nullopt;
    return mb_per_s(width_px, height_px, aravis->pixel_format, *aravis->rate_hz);
  }
  if (const auto* v4l2 = camera.driver.as<V4l2Settings>()) {
    return mb_per_s(v4l2->width_px, v4l2->height_px, v4l2->pixel_format, v4l2->rate_hz);
  }
  return std::nullopt;
}

std::string UsbLoad::text() const {
  std::string list, narrow;
  for (const std::string& each : cameras) list += (list.empty() ? "" : " + ") + each;
  for (const std::string& each : slow) narrow += "; " + each;
  return fmt::format("{} of controller {}: cameras send {:.1f} MB/s ({}) of {:.0f} MB/s that it gives{}", bus,
                     controller, needed_mb_per_s, list, given_mb_per_s, narrow);
}

std::vector<UsbLoad> usb_loads(const std::vector<CameraSettings>& cameras, const Rig& rig, const fs::path& sys) {
  const std::vector<UsbDevice> devices = list_usb_devices(sys);
  std::vector<UsbLoad> loads;
  std::map<fs::path, Link> links;
  for (const CameraSettings& camera : cameras) {
    const UsbDevice* const device = device_of(camera, devices, sys);
    if (device == nullptr) continue;
    auto load = std::find_if(loads.begin(), loads.end(), [&](const UsbLoad& each) { return each.bus == device->bus; });
    if (load == loads.end()) {
      loads.push_back({.bus = device->bus,
                       .controller = device->controller,
                       .given_mb_per_s = usable_mb_per_s(device->bus_mbps),
                       .cameras = {},
                       .slow = {}});
      load = loads.end() - 1;
    }
    const auto model = std::find_if(rig.begin(), rig.end(), [&](const auto& each) { return each.name == camera.name; });
    const std::optional<double> needed = needed_mb_per_s(camera, model != rig.end() ? &*model : nullptr);
    load->cameras.push_back(needed ? fmt::format("{} {:.1f}", camera.name, *needed) : camera.name + " ?");
    load->needed_mb_per_s += needed.value_or(0.0);
    add_to_links(links, *device, camera.name, needed.value_or(0.0));
  }
  for (const auto& [folder, link] : links) {
    if (link.needed_mb_per_s <= link.given_mb_per_s) continue;
    for (UsbLoad& load : loads) {
      if (load.bus == link.bus) load.slow.push_back(link.text());
    }
  }
  return loads;
}

std::vector<std::string> usb_buses_of_cameras(const fs::path& sys) {
  struct Bus {
    UsbDevice any;
    std::vector<std::string> cameras;
  };
  std::map<std::string, Bus> buses;
  for (const UsbDevice& each : list_usb_devices(sys)) {
    if (!each.usb3_vision && !each.uvc) continue;
    const bool slower = usable_mb_per_s(each.speed_mbps) < usable_mb_per_s(each.bus_mbps);
    Bus& bus = buses[each.bus];
    bus.any = each;
    bus.cameras.push_back((each.serial.empty() ? each.product : each.serial) +
                          (slower ? fmt::format(" (at {:.0f} Mbit/s)", each.speed_mbps) : ""));
  }
  std::vector<std::string> lines;
  for (const auto& [name, bus] : buses) {
    lines.push_back(fmt::format(
        "{} of controller {} gives {:.0f} MB/s{}, {} {}", name, bus.any.controller, usable_mb_per_s(bus.any.bus_mbps),
        bus.any.pcie_mb_per_s > 0.0 ? fmt::format(" (all its buses {:.0f} MB/s)", bus.any.pcie_mb_per_s) : "",
        bus.cameras.size() > 1 ? "shared by" : "to", fmt::join(bus.cameras, " and ")));
  }
  return lines;
}

}  // namespace mocap::cameras
