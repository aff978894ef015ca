#include "export/write_options.h"

namespace mocap::exports {

std::string_view name_of(Axes axes) noexcept { return axes == Axes::ZUp ? "z-up" : "y-up"; }

std::string_view name_of(Unit unit) noexcept {
  return unit == Unit::Metre ? "m" : unit == Unit::Centimetre ? "cm" : "mm";
}

double per_metre(Unit unit) noexcept { return unit == Unit::Metre ? 1.0 : unit == Unit::Centimetre ? 1e2 : 1e3; }

int decimals_of(Unit unit) noexcept { return unit == Unit::Metre ? 7 : unit == Unit::Centimetre ? 5 : 4; }

}  // namespace mocap::exports
