#include "settings/keys.h"

#include <numbers>

namespace mocap::settings {
namespace {

double seconds_of(TimeUnit unit) {
  switch (unit) {
    case TimeUnit::Microseconds: return 1e-6;
    case TimeUnit::Milliseconds: return 1e-3;
    case TimeUnit::Seconds: return 1.0;
  }
  return 1.0;
}

}  // namespace

void Keys::time(std::string_view key, Duration& field, TimeUnit unit, Range range) {
  const double unit_s = seconds_of(unit);
  // Divided as nanoseconds by whole nanoseconds, so that 500 us is 500 and not 499.99999.
  std::optional<double> value = static_cast<double>(field.count()) / (unit_s * 1e9);
  real(key, value, range);
  field = from_s(*value * unit_s);
}

void Keys::degrees(std::string_view key, double& field_rad, Range range_degrees) {
  const double before = field_rad * 180.0 / std::numbers::pi;
  std::optional<double> value = before;
  real(key, value, range_degrees);
  if (*value != before) field_rad = *value * std::numbers::pi / 180.0;
}

void Keys::millimetres(std::string_view key, double& field_m, Range range_mm) {
  const double before = field_m * 1e3;
  std::optional<double> value = before;
  real(key, value, range_mm);
  if (*value != before) field_m = *value * 1e-3;
}

}  // namespace mocap::settings
