#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace mocap::eval {

/// The words of a list that commas separate.
std::vector<std::string> words_of(const std::string& list);

/// The error of a word of `option` that is none of `known`.
Error unknown_word(std::string_view option, std::string_view word, std::span<const std::string_view> known);

}  // namespace mocap::eval
