#include "lib/cli/shown_text.h"

namespace mocap::cli {

namespace {

bool continues_a_character(char byte) { return (static_cast<unsigned char>(byte) & 0xC0U) == 0x80U; }

}  // namespace

std::string shown(std::string_view text, std::size_t bytes) {
  std::string clean;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : '\0');
    const bool c1 = byte == 0xC2U && next >= 0x80U && next <= 0x9FU;
    clean += byte < 0x20U || byte == 0x7FU || c1 ? ' ' : text[i];
    if (c1) ++i;
  }
  if (clean.size() <= bytes) return clean;
  while (bytes > 0 && continues_a_character(clean[bytes])) --bytes;
  return clean.substr(0, bytes);
}

std::string shown_lines(std::string_view text) {
  std::string lines;
  for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    lines += shown(text.substr(0, end)) + '\n';
    text.remove_prefix(end + 1);
  }
  return lines + shown(text);
}

}  // namespace mocap::cli
