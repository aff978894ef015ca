#pragma once

#include <chrono>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::synchronise {

/// [align]: images of all cameras at one instant. Help, units and ranges: the table in align_settings.cpp.
struct AlignSettings {
  Duration window = std::chrono::microseconds(500);
  /// A host that takes the processor away does so for up to 20 ms; the frames of that time then still find their sets.
  Duration patience = std::chrono::milliseconds(30);

  bool operator==(const AlignSettings&) const = default;
};

void declare_keys(KeyVisitor& keys, AlignSettings& align);

}  // namespace mocap::synchronise
