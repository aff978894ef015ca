#pragma once

#include <string_view>

#include "export/bone_names.h"

namespace mocap::exports {

enum class Axes {
  ZUp,  ///< x, y, z of the world
  YUp,  ///< y, z, x of the world: the axes of skeletons, see to_y_up
};

enum class Unit { Metre, Centimetre, Millimetre };

/// Axes, unit and bone names of a file.
struct WriteOptions {
  Axes axes = Axes::ZUp;
  Unit unit = Unit::Millimetre;
  BoneNames names = BoneNames::Skeleton;
};

/// "z-up" or "y-up".
std::string_view name_of(Axes axes) noexcept;

/// "m", "cm" or "mm".
std::string_view name_of(Unit unit) noexcept;

/// The number of `unit`s in a metre.
double per_metre(Unit unit) noexcept;

/// Digits after the decimal point that keep 0.1 um.
int decimals_of(Unit unit) noexcept;

}  // namespace mocap::exports
