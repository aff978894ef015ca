#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::settings {

/// How many characters must be inserted, deleted, replaced, or swapped with their neighbour to turn one word into the
/// other (optimal string alignment distance).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word that was probably meant: the nearest, if it is near (a third of its length at most). Nothing where
/// none is.
std::optional<std::string> nearest_word(std::string_view word, const std::vector<std::string>& known);

}  // namespace mocap::settings
