#include "cameras/driver_settings.h"

namespace mocap::cameras {

void DriverSettings::declare(KeyVisitor& keys) {
  if (held_) held_->declare(keys);
}

std::vector<KeyFault> DriverSettings::faults() const { return held_ ? held_->rule_faults() : std::vector<KeyFault>{}; }

std::vector<KeyFault> DriverSettings::all_faults() const {
  if (!held_) return {};
  std::vector<KeyFault> all = held_->value_faults();
  for (KeyFault& fault : held_->rule_faults()) all.push_back(std::move(fault));
  return all;
}

CameraFacts DriverSettings::facts(const std::string& camera_name) const {
  return held_ ? held_->facts(camera_name) : CameraFacts{};
}

}  // namespace mocap::cameras
