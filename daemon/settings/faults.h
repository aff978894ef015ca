#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace mocap::settings {

/// One thing that is wrong in a file, and where.
struct Fault {
  std::filesystem::path file;
  std::uint32_t line = 0;    ///< from 1; 0: the file as a whole
  std::uint32_t column = 0;  ///< from 1, in characters
  std::string message;       ///< names the thing, the value, what was expected
};

/// All that is wrong with a file and the files that it names; at least one.
struct Faults {
  std::filesystem::path file;
  std::vector<Fault> list;
};

/// "config/mocapd.toml:14:15: camera 'north-east': exposure_us is 25000, expected 10 to 20000".
std::string to_text(const Fault& fault);

/// A line a fault in the order of their places, and the sum: "config/mocapd.toml: 2 faults, nothing started". Ends
/// without a newline.
std::string to_text(const Faults& faults);

}  // namespace mocap::settings
