#pragma once

#include <string>

namespace mocap::take {

/// The reason of the system for an error number, and for a common one what to do: "No space left on device; free space
/// on its disk".
std::string disk_reason(int error_number);

}  // namespace mocap::take
