#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace mocap::settings {

/// A place in a file.
struct Place {
  std::uint32_t line = 0;    ///< from 1
  std::uint32_t column = 0;  ///< from 1, in characters
};

/// One fault of a file and its place.
struct Fault {
  std::filesystem::path file;
  std::uint32_t line = 0;    ///< from 1; 0: the whole file
  std::uint32_t column = 0;  ///< from 1, in characters
  std::string message;       ///< names the key, the value and what was expected
};

/// All faults of a file and of the files that it names.
struct Faults {
  std::filesystem::path file;
  std::vector<Fault> list;
};

/// "config/mocapd.toml:14:15: camera 'north-east': exposure_us is 25000, expected 10 to 20000".
std::string to_text(const Fault& fault);

/// One line for each fault in the order of their places, and a last line with their number: "config/mocapd.toml: 2
/// faults, nothing started". Ends without a newline.
std::string to_text(const Faults& faults);

}  // namespace mocap::settings
