#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace mocap::ctl {

/// The text of a JSON value for standard output. Bytes that are not valid UTF-8, for example of the name of a file,
/// become U+FFFD; dump() alone throws at them. `indent`: spaces of each level; -1: one line.
template <class Json>
std::string json_line(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace mocap::ctl
