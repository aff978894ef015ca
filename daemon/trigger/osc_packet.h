#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "base/result.h"
#include "trigger/request.h"

namespace mocap::trigger {

using OscValue = std::variant<std::string, std::int32_t>;

/// Reads a message of OSC 1.0, or a bundle of one: /RecordStart [slate [take]] or /RecordStop. A take with a slate and
/// a number is named SLATE_NNN. Fails with InvalidArgument if the packet is not one complete message, or another one.
Result<Request> read_osc(std::string_view packet);

/// A message of OSC 1.0.
std::string write_osc(std::string_view address, const std::vector<OscValue>& values);

}  // namespace mocap::trigger
