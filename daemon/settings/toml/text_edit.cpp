#include "settings/toml/text_edit.h"

#include <algorithm>

namespace mocap::settings {

LineIndex::LineIndex(const std::string& text) : text_(text), starts_{0} {
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) starts_.push_back(++at);
}

std::size_t LineIndex::offset_of(std::uint32_t line, std::uint32_t column) const {
  return std::min(starts_[std::min<std::size_t>(line, starts_.size()) - 1] + column - 1, text_.size());
}

std::size_t LineIndex::next_line(std::size_t offset) const {
  const std::size_t newline = text_.find('\n', offset);
  return newline == std::string::npos ? text_.size() : newline + 1;
}

std::string edited(const std::string& text, std::vector<TextEdit> edits) {
  // From the end to the beginning, so that offsets of the remaining edits stay valid.
  std::stable_sort(edits.begin(), edits.end(), [](const auto& a, const auto& b) { return a.begin > b.begin; });
  std::string result = text;
  for (const TextEdit& edit : edits) result.replace(edit.begin, edit.end - edit.begin, edit.text);
  return result;
}

}  // namespace mocap::settings
