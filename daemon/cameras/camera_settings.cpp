#include "cameras/camera_settings.h"

#include <fmt/format.h>

#include <algorithm>

#include "cameras/camera_make.h"
#include "model/camera_model.h"

namespace mocap::cameras {
namespace {

// The name occurs in log lines and as the name of folders.
std::vector<KeyFault> name_faults(const std::string& name) {
  const auto bad = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '/' || c == '\'' || c == '"'; };
  if (name == kRigMetadata)
    return {{"name", fmt::format("name is '{}', which a rig file has for its facts; expected another name", name)}};
  if (!name.empty() && name.size() <= 63 && std::none_of(name.begin(), name.end(), bad)) return {};
  return {{"name", fmt::format("name is '{}', expected 1 to 63 characters without quotes and slashes", name)}};
}

}  // namespace

void declare_keys(KeyVisitor& keys, CameraSettings& camera) {
  const CameraMake* make = find_make(camera.driver.driver());
  keys.text("name", camera.name,
            {.help = "used in the log, in the rig and on the wire",
             .example = make != nullptr ? make->name.example_name : "",
             .required = "the camera's name in the log, in the rig and on the wire"});
  std::string driver(camera.driver.driver());
  keys.one_of("driver", driver, driver_words(), {.help = "make of the camera", .required = driver_list()});
  if (driver != camera.driver.driver()) {
    if (const CameraMake* wanted = find_make(driver)) camera.driver = wanted->defaults();
  }
  keys.number(
      "threshold", camera.threshold, {0, 255},
      {.help = "replaces threshold of [detect] for this camera; 0: estimated from the image noise", .example = "120"});
  keys.number("low_threshold", camera.low_threshold, {0, 255},
              {.help = "replaces low_threshold of [detect] for this camera", .example = "40"});
  camera.driver.declare(keys);
}

CameraFacts facts_of(const CameraSettings& camera) { return camera.driver.facts(camera.name); }

std::vector<KeyFault> faults_of(const CameraSettings& camera) {
  std::vector<KeyFault> faults = name_faults(camera.name);
  for (KeyFault& fault : camera.driver.faults()) faults.push_back(std::move(fault));
  if (camera.threshold && *camera.threshold > 0.0 && *camera.threshold < 1.0) {
    faults.push_back(
        {"threshold", fmt::format("threshold is {}, expected 1 to 255, or 0: from the noise", *camera.threshold)});
  }
  return faults;
}

}  // namespace mocap::cameras
