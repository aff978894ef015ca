#include "eval/benchmark_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace mocap::eval {

std::vector<std::string> words_of(const std::string& list) {
  std::vector<std::string> words(1);
  for (const char c : list) {
    if (c == ',') {
      words.emplace_back();
    } else {
      words.back().push_back(c);
    }
  }
  return words;
}

Error unknown_word(std::string_view option, std::string_view word, std::span<const std::string_view> known) {
  return {ErrorCode::InvalidArgument, fmt::format("{}: '{}', expected {}", option, word, fmt::join(known, ", "))};
}

}  // namespace mocap::eval
