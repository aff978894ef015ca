#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace mocap::settings {

/// Number of characters to insert, delete, replace, or swap with their neighbour to make one word of the other (optimal
/// string alignment distance; Damerau 1964, restricted edit distance).
std::size_t edit_distance(std::string_view a, std::string_view b);

/// The known word with the smallest edit distance, if that is at most a third of the length of the longer word.
std::optional<std::string> nearest_word(std::string_view word, const std::vector<std::string>& known);

/// ", did you mean 'x'?" with the nearest word; empty if there is none.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& known);

}  // namespace mocap::settings
