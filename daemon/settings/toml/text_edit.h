#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace mocap::settings {

/// The part of a text from `begin` to `end` (offsets) and its replacement.
struct TextEdit {
  std::size_t begin;
  std::size_t end;
  std::string text;
};

/// The offsets of the lines of a text. The text outlives it.
class LineIndex {
 public:
  explicit LineIndex(const std::string& text);

  /// Line and column count from 1, as parsers report them.
  std::size_t offset_of(std::uint32_t line, std::uint32_t column) const;
  /// The offset of the line after the one that contains `offset`.
  std::size_t next_line(std::size_t offset) const;

 private:
  const std::string& text_;
  std::vector<std::size_t> starts_;
};

/// The offset of a position that a parser reports.
template <class Position>
std::size_t offset_in(const LineIndex& lines, const Position& at) {
  return lines.offset_of(at.line, at.column);
}

/// The text with all edits applied. Edits do not overlap.
std::string edited(const std::string& text, std::vector<TextEdit> edits);

}  // namespace mocap::settings
