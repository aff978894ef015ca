#pragma once

#include <cstddef>
#include <string>

namespace mocap::calibration {

/// "the top left": which ninth of an image has the fewest marked ones of its n x n fields (row by row); empty where
/// each has at least half.
std::string emptiest_part(const auto& fields, int n) {
  static constexpr const char* kNames[9] = {"the top left",    "the top",    "the top right",
                                            "the left",        "the middle", "the right",
                                            "the bottom left", "the bottom", "the bottom right"};
  double least = 0.5;
  std::string name;
  for (int part = 0; part < 9; ++part) {
    int marked = 0;
    int all = 0;
    for (int y = (part / 3) * n / 3; y < (part / 3 + 1) * n / 3; ++y) {
      for (int x = (part % 3) * n / 3; x < (part % 3 + 1) * n / 3; ++x) {
        marked += fields[static_cast<std::size_t>(y * n + x)] > 0 ? 1 : 0;
        ++all;
      }
    }
    const double share = static_cast<double>(marked) / all;
    if (share >= least) continue;
    least = share;
    name = kNames[part];
  }
  return name;
}

}  // namespace mocap::calibration
