#include "lib/cli/shown_text.h"

#include <cstddef>

namespace mocap::cli {

std::string shown(std::string_view text) {
  std::string clean;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto byte = static_cast<unsigned char>(text[i]);
    const auto next = static_cast<unsigned char>(i + 1 < text.size() ? text[i + 1] : '\0');
    const bool c1 = byte == 0xC2U && next >= 0x80U && next <= 0x9FU;
    clean += byte < 0x20U || byte == 0x7FU || c1 ? ' ' : text[i];
    if (c1) ++i;
  }
  return clean;
}

}  // namespace mocap::cli
