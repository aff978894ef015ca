#include "settings/toml/number_lists.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "base/key_visitor.h"

namespace mocap::settings {
namespace {

constexpr std::size_t kLeastCorners = 3;
constexpr KeyRange kCorner_px{-1e6, 1e6};  // a polygon may extend beyond its image

NumberFault wrong_value(std::string_view key, const NumberNode& value, std::string_view expected) {
  return {value.at, fmt::format("{} is {}, expected {}", key, value.text, expected)};
}

// The first element that is no finite number.
const NumberNode* first_not_finite(const NumberNode& list) {
  const auto found = std::ranges::find_if(
      list.elements, [](const NumberNode& each) { return !each.number || !std::isfinite(*each.number); });
  return found == list.elements.end() ? nullptr : &*found;
}

std::optional<PixelPoint> corner_of(const NumberNode& pair) {
  if (!pair.is_list || pair.elements.size() != 2) return std::nullopt;
  PixelPoint corner;
  for (const std::size_t axis : {0U, 1U}) {
    const std::optional<double>& value = pair.elements[axis].number;
    if (!value || !is_within(*value, kCorner_px)) return std::nullopt;
    corner.v[static_cast<Eigen::Index>(axis)] = *value;
  }
  return corner;
}

}  // namespace

Result<std::vector<double>, NumberFault> list_of(std::string_view key, const NumberNode& value,
                                                 std::initializer_list<std::size_t> lengths) {
  if (!value.is_list || std::ranges::find(lengths, value.elements.size()) == lengths.end()) {
    return wrong_value(key, value, fmt::format("a list of {} numbers", fmt::join(lengths, " or ")));
  }
  if (const NumberNode* wrong = first_not_finite(value)) {
    return NumberFault{wrong->at, fmt::format("{} has {}, expected finite numbers", key, wrong->text)};
  }
  std::vector<double> found;
  for (const NumberNode& each : value.elements) found.push_back(*each.number);
  return found;
}

Result<std::vector<double>, NumberFault> matrix_of(std::string_view key, const NumberNode& value, std::size_t rows,
                                                   std::size_t columns) {
  const std::string expected = fmt::format("{} lists of {} numbers", rows, columns);
  if (!value.is_list || value.elements.size() != rows) return wrong_value(key, value, expected);
  std::vector<double> found;
  for (const NumberNode& row : value.elements) {
    if (!row.is_list || row.elements.size() != columns) {
      return NumberFault{row.at, fmt::format("{} has {} as a row, expected {}", key, row.text, expected)};
    }
    const auto numbers = list_of(key, row, {columns});
    if (!numbers) return numbers.error();
    found.insert(found.end(), numbers->begin(), numbers->end());
  }
  return found;
}

Result<std::vector<MaskPolygon>, NumberFault> polygons_of(std::string_view key, const NumberNode& value) {
  if (!value.is_list) return wrong_value(key, value, "a list of polygons: [[[x, y], [x, y], [x, y]], ...]");
  std::vector<MaskPolygon> found;
  for (const NumberNode& polygon : value.elements) {
    if (!polygon.is_list || polygon.elements.size() < kLeastCorners) {
      return NumberFault{polygon.at, fmt::format("{} has {} as a polygon, expected a list of at least {} corners", key,
                                                 polygon.text, kLeastCorners)};
    }
    MaskPolygon& into = found.emplace_back();
    for (const NumberNode& corner : polygon.elements) {
      const std::optional<PixelPoint> at = corner_of(corner);
      if (!at) {
        return NumberFault{corner.at, fmt::format("{} has {} as a corner, expected [x, y], px, each {}", key,
                                                  corner.text, range_text(kCorner_px))};
      }
      into.push_back(*at);
    }
  }
  return found;
}

}  // namespace mocap::settings
