#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mocap::settings {

/// A stretch of a text, and what comes in its place.
struct TextEdit {
  std::size_t begin;
  std::size_t end;
  std::string text;
};

/// Where lines begin. The text outlives it.
class LineIndex {
 public:
  explicit LineIndex(const std::string& text);

  /// Line and column from 1, as parsers tell them.
  std::size_t offset_of(std::uint32_t line, std::uint32_t column) const;
  /// Behind the newline of the line that `offset` is in.
  std::size_t next_line(std::size_t offset) const;

 private:
  const std::string& text_;
  std::vector<std::size_t> starts_;
};

/// The text with all edits made; they do not overlap.
std::string edited(const std::string& text, std::vector<TextEdit> edits);

}  // namespace mocap::settings
