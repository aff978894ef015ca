#include "bridges/rokoko/lz4_frame.h"

#include <lz4frame.h>

namespace mocap::rokoko {

std::string lz4_frame(std::string_view text) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.contentSize = text.size();
  std::string packet(LZ4F_compressFrameBound(text.size(), &preferences), '\0');
  const std::size_t size = LZ4F_compressFrame(packet.data(), packet.size(), text.data(), text.size(), &preferences);
  packet.resize(LZ4F_isError(size) != 0 ? 0 : size);
  return packet;
}

}  // namespace mocap::rokoko
