#pragma once

#include <nlohmann/json.hpp>
#include <optional>

namespace mocap::scoring {

/// A figure as JSON; null where there is none.
inline nlohmann::ordered_json or_null(const std::optional<double>& figure) {
  if (!figure) return nullptr;
  return *figure;
}

}  // namespace mocap::scoring
