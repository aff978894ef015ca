#pragma once

#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "model/image_mask.h"
#include "settings/faults.h"

namespace mocap::settings {

/// A value of a file that should be a number, or a list of such values.
struct NumberNode {
  Place at;
  std::string text;                  ///< the value in a fault, as "a list of 3"
  std::optional<double> number;      ///< nothing if the value is no number
  bool is_list = false;              ///< whether the value is a list
  std::vector<NumberNode> elements;  ///< of a list
};

/// A value that is not as expected.
struct NumberFault {
  Place at;             ///< of the value, or of its element
  std::string message;  ///< names the key, the value and what was expected
};

/// The numbers of a list, whose length is one of `lengths`. Fails at a number that is not finite.
Result<std::vector<double>, NumberFault> list_of(std::string_view key, const NumberNode& value,
                                                 std::initializer_list<std::size_t> lengths);

/// The numbers of `rows` lists of `columns` numbers each, row by row; otherwise as `list_of`.
Result<std::vector<double>, NumberFault> matrix_of(std::string_view key, const NumberNode& value, std::size_t rows,
                                                   std::size_t columns);

/// A list of polygons, each a list of at least three corners [x, y], px, each -1e6 to 1e6.
Result<std::vector<MaskPolygon>, NumberFault> polygons_of(std::string_view key, const NumberNode& value);

}  // namespace mocap::settings
