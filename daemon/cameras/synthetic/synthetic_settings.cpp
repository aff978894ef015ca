#include "cameras/synthetic/synthetic_settings.h"

#include "scene/program.h"

namespace mocap::cameras {

void declare_keys(KeyVisitor& keys, SyntheticSettings& camera) {
  constexpr KeyRange kSide_px{16, 16384};
  keys.text("motion", camera.motion, {.help = "motions as mocap-sim --motion takes them, each with its seconds"});
  keys.path("marker_set", camera.marker_set,
            {.help = "marker set of the simulated subject",
             .example = "markersets/openmocap18.toml",
             .required = "a file of config/markersets"});
  keys.number("width_px", camera.width_px, kSide_px, {.help = "as in the rig"});
  keys.number("height_px", camera.height_px, kSide_px, {.help = "as in the rig"});
  keys.number("rate_hz", camera.rate_hz, {0.1, 10000}, {.help = "images per second"});
  keys.number("exposure_us", camera.exposure_us, {1, 1e6});
  keys.number("noise_grey", camera.noise_grey, {0, 100}, {.help = "read noise: standard deviation in grey levels"});
  keys.number("seed", camera.seed, {0, 9e15}, {.help = "of the noise"});
  keys.number("speed", camera.speed, {0, 1000}, {.help = "1: real time; 0: as fast as possible"});
}

std::vector<KeyFault> faults_of(const SyntheticSettings& camera) {
  if (const auto program = scene::parse_program(camera.motion); !program) return {{"motion", program.error().message}};
  return {};
}

CameraFacts facts_of(const SyntheticSettings& camera, const std::string& /*camera_name*/) {
  return {.rate_hz = camera.rate_hz,
          .exposure_us = camera.exposure_us,
          .size = ImageSize{camera.width_px, camera.height_px},
          .marker_set = camera.marker_set,
          .recorded_time = camera.speed == 0.0};
}

}  // namespace mocap::cameras
