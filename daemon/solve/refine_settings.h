#pragma once

#include <chrono>
#include <cstddef>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::solve {

/// [refine]: bodies are refitted while they are tracked. Help, units and ranges: the table in refine_settings.cpp.
struct RefineSettings {
  std::size_t instants = 40;
  Duration look_every = std::chrono::milliseconds(40);
  std::size_t pieces = 2;
  double least_gain = 0.02;

  bool operator==(const RefineSettings&) const = default;
};

void declare_keys(KeyVisitor& keys, RefineSettings& refine);

}  // namespace mocap::solve
