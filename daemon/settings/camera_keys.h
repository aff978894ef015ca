#pragma once

#include <optional>

#include "cameras/camera_settings.h"
#include "settings/keys.h"
#include "settings/toml_file.h"

namespace mocap::settings {

/// One [[camera]]: `name`, `driver`, and the keys of that driver.
void tell(Keys& keys, cameras::CameraSettings& camera);

/// Reads one [[camera]]; what is missing or contradicts itself is a fault of the table.
cameras::CameraSettings read_camera(TomlTable& table);

/// The driver's word in the configuration: aravis, v4l2, replay, synthetic.
const char* driver_of(const cameras::CameraSettings& camera);

/// Images a second, as far as the configuration tells.
std::optional<double> rate_hz_of(const cameras::CameraSettings& camera);

/// Width and height, px, as far as the configuration tells.
struct ImageSize {
  int width_px;
  int height_px;
};
std::optional<ImageSize> size_of(const cameras::CameraSettings& camera);

}  // namespace mocap::settings
