#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"
#include "base/time.h"

namespace mocap::take {

/// Fails with InvalidArgument if a pattern of names has an unknown placeholder, no {number}, or is no file name.
Status check_pattern(const std::string& pattern);

/// Fails with InvalidArgument if a name or slate cannot be part of a file name: empty, '/', control characters, a
/// leading dot or hyphen, or over 100 bytes. `what` names it in the message.
Status check_name(const std::string& name, const char* what);

struct TakeName {
  std::string name;
  std::uint32_t number = 0;  ///< 0: a name without number
};

/// The next name in a folder: its number is one more than the largest of the takes that the pattern names with the same
/// slate and date. `utc`: time since 1970.
TakeName next_name(const std::filesystem::path& folder, const std::string& pattern, const std::string& slate,
                   Duration utc);

/// Whether the folder has a take of this name; and the first of NAME-2, NAME-3, ... that it does not have.
bool has_take(const std::filesystem::path& folder, const std::string& name);
std::string free_name(const std::filesystem::path& folder, const std::string& name);

}  // namespace mocap::take
