#pragma once

#include <chrono>
#include <cstddef>

#include "base/key_visitor.h"
#include "base/time.h"

namespace mocap::label {

/// [label]: the labels of the markers. Help, units and ranges: the table in label_settings.cpp.
struct LabelSettings {
  Duration still_for = std::chrono::milliseconds(400);
  double still_radius_m = 0.02;
  Duration search_every = std::chrono::milliseconds(100);
  bool search_uncalibrated = false;
  /// No key: bone fits in each set at 120 Hz, under 1 us each, of the search for a body in any pose (decision 0021).
  std::size_t search_work = 1200;
  /// No key: hypotheses in each set and subject, of one or two poses each, for limbs that lost their labels.
  int limb_work = 40;
  double most_rms_m = 0.02;
  double least_share = 0.85;
  double rigid_tolerance_m = 0.006;
  double distance_tolerance_m = 0.02;
  double most_gate_m = 0.25;
  Duration lost_after = std::chrono::milliseconds(500);
};

void declare_keys(KeyVisitor& keys, LabelSettings& label);

}  // namespace mocap::label
