#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/camera_model.h"
#include "model/skeleton.h"

namespace mocap {

/// What a client must know to read snapshots; changes rarely, and then its version does.
struct Description {
  std::uint32_t version = 1;
  std::string producer;    ///< program and version
  std::string session_id;  ///< of this run
  double nominal_rate_hz = 0.0;
  Rig cameras;
  std::vector<Subject> subjects;
};

}  // namespace mocap
