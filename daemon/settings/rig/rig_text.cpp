#include "settings/rig/rig_text.h"

#include <fmt/format.h>

namespace mocap::settings {

std::string mask_text(std::span<const MaskPolygon> polygons) {
  std::string text;
  for (const MaskPolygon& polygon : polygons) {
    std::string corners;
    for (const PixelPoint& corner : polygon) {
      corners += (corners.empty() ? "" : ", ") + list_text({corner.v.x(), corner.v.y()});
    }
    text += fmt::format("  [{}],\n", corners);
  }
  return text.empty() ? "[]" : "[\n" + text + "]";
}

}  // namespace mocap::settings
