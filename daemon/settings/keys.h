#pragma once

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/time.h"

namespace mocap::settings {

/// The smallest and the largest value that a key may have.
struct Range {
  double min;
  double max;
};

enum class TimeUnit { Microseconds, Milliseconds, Seconds };

/// One section of a configuration: which keys it has, and which field of a struct each fills.
///
/// A section is told once, as a function with a line a key (see stage_keys.cpp). Read through TomlTable it fills the
/// struct from a file; listed through KeyList it writes the struct down. A value that is out of range or of the wrong
/// type is a fault, and the field keeps its default.
class Keys {
 public:
  virtual ~Keys() = default;

  template <class T>
  requires std::is_floating_point_v<T>
  void number(std::string_view key, T& field, Range range) {
    std::optional<double> value = static_cast<double>(field);
    real(key, value, range);
    field = static_cast<T>(*value);
  }

  template <class T>
  requires(std::is_integral_v<T> && !std::is_same_v<T, bool>) void number(std::string_view key, T& field, Range range) {
    std::optional<std::int64_t> value = static_cast<std::int64_t>(field);
    whole(key, value, range);
    field = static_cast<T>(*value);
  }

  /// Absent where the file has no such key.
  void number(std::string_view key, std::optional<double>& field, Range range) { real(key, field, range); }

  template <class T>
  requires(std::is_integral_v<T> && !std::is_same_v<T, bool>) void number(std::string_view key, std::optional<T>& field,
                                                                          Range range) {
    std::optional<std::int64_t> value;
    if (field) value = static_cast<std::int64_t>(*field);
    whole(key, value, range);
    if (value) field = static_cast<T>(*value);
  }

  /// A number of the file's unit, which the key names (`window_us`).
  void time(std::string_view key, Duration& field, TimeUnit unit, Range range);

  /// Angles: degrees in the file, rad in the field.
  void degrees(std::string_view key, double& field_rad, Range range_degrees);

  /// Lengths: mm in the file, m in the field.
  void millimetres(std::string_view key, double& field_m, Range range_mm);

  /// One word of several; `words` pairs each with its value.
  template <class E>
  void choice(std::string_view key, E& field, std::initializer_list<std::pair<std::string_view, E>> words) {
    std::vector<std::string> names;
    std::string name;
    for (const auto& [word, value] : words) {
      names.emplace_back(word);
      if (value == field) name = word;
    }
    one_of(key, name, names);
    for (const auto& [word, value] : words) {
      if (word == name) field = value;
    }
  }

  virtual void flag(std::string_view key, bool& field) = 0;
  virtual void text(std::string_view key, std::string& field) = 0;
  /// A path in a file is relative to that file; the field gets it whole. Empty: none.
  virtual void path(std::string_view key, std::filesystem::path& field) = 0;
  virtual void one_of(std::string_view key, std::string& field, const std::vector<std::string>& words) = 0;
  /// A list of whole numbers, any length.
  virtual void whole_numbers(std::string_view key, std::vector<int>& field, Range range) = 0;
  /// A list of texts, any length.
  virtual void texts(std::string_view key, std::vector<std::string>& field) = 0;
  /// `count` numbers.
  virtual void numbers(std::string_view key, double* fields, std::size_t count, Range range) = 0;
  /// A table of words, numbers and switches of any name, as text, in the order of the file.
  virtual void pairs(std::string_view key, std::vector<std::pair<std::string, std::string>>& field) = 0;

 protected:
  virtual void real(std::string_view key, std::optional<double>& value, Range range) = 0;
  virtual void whole(std::string_view key, std::optional<std::int64_t>& value, Range range) = 0;
};

}  // namespace mocap::settings
