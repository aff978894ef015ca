#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/time.h"

namespace mocap {

/// Smallest and largest value that a number may have, in the unit of the file.
struct KeyRange {
  double min = 0.0;
  double max = 0.0;
};

/// Documentation of a key. `help` and the range or the choices become the comment beside the key in config/mocapd.toml.
struct KeyDoc {
  std::string_view help = {};
  std::string_view example = {};   ///< value that config/mocapd.toml shows for a key without a default; text unquoted
  bool example_is_active = false;  ///< the example is a line of its own; otherwise a comment
  std::string_view required = {};  ///< what a file must give: "key is missing, expected ..."; empty: may be absent
  bool must_exist = false;         ///< of a path: loading a file fails if nothing is there
  std::string_view formerly = {};  ///< former name of the key, which a file may still have
};

/// One key of a configuration table.
struct Key {
  std::string_view name;
  KeyDoc doc = {};
  KeyRange range = {};                         ///< of a number
  std::vector<std::string_view> choices = {};  ///< of a word; "Line<n>" stands for Line0, Line1, ...; empty: any text
};

/// A key that breaks a rule. An empty key means the table as a whole.
struct KeyFault {
  std::string key;
  std::string message;  ///< names the key, the value and what was expected
};

/// A table of words, numbers and switches of any name, as text, in the order of the file.
using KeyPairs = std::vector<std::pair<std::string, std::string>>;

/// Walks over the keys of a settings struct.
///
/// Each settings struct has a function `void declare_keys(KeyVisitor& keys, S& settings)` beside it, with one line per
/// key: name in the file, field, range or choices, help. That line and the field's default are the only places that
/// know the setting. A reader fills the struct from a file, a lister writes it down, a checker compares it with its
/// ranges (KeyCheck). A visitor that finds a wrong value keeps the field as it is.
class KeyVisitor {
 public:
  virtual ~KeyVisitor() = default;

  template <class T>
  requires std::is_floating_point_v<T>
  void number(std::string_view name, T& field, KeyRange range, const KeyDoc& doc = {}) {
    std::optional<double> value = static_cast<double>(field);
    visit(Key{name, doc, range}, value);
    field = static_cast<T>(*value);
  }

  template <class T>
  requires(std::is_integral_v<T> && !std::is_same_v<T, bool>) void number(std::string_view name, T& field,
                                                                          KeyRange range, const KeyDoc& doc = {}) {
    std::optional<std::int64_t> value = static_cast<std::int64_t>(field);
    visit(Key{name, doc, range}, value);
    field = static_cast<T>(*value);
  }

  /// Stays empty if the file does not have the key.
  void number(std::string_view name, std::optional<double>& field, KeyRange range, const KeyDoc& doc = {}) {
    visit(Key{name, doc, range}, field);
  }

  template <class T>
  requires(std::is_integral_v<T> && !std::is_same_v<T, bool>) void number(std::string_view name,
                                                                          std::optional<T>& field, KeyRange range,
                                                                          const KeyDoc& doc = {}) {
    std::optional<std::int64_t> value;
    if (field) value = static_cast<std::int64_t>(*field);
    visit(Key{name, doc, range}, value);
    if (value) field = static_cast<T>(*value);
  }

  /// A duration whose unit is the end of the key's name: `_us`, `_ms` or `_s`.
  void time(std::string_view name, Duration& field, KeyRange range, const KeyDoc& doc = {});

  /// An angle: degrees in the file, rad in the field.
  void degrees(std::string_view name, double& field_rad, KeyRange range_degrees, const KeyDoc& doc = {});

  /// A length: mm in the file, m in the field.
  void millimetres(std::string_view name, double& field_m, KeyRange range_mm, const KeyDoc& doc = {});

  void flag(std::string_view name, bool& field, const KeyDoc& doc = {}) { visit(Key{name, doc}, field); }

  void text(std::string_view name, std::string& field, const KeyDoc& doc = {}) { visit(Key{name, doc}, field); }

  /// A path in a file is relative to that file; the field gets the joined path. Empty: none.
  void path(std::string_view name, std::filesystem::path& field, const KeyDoc& doc = {}) {
    visit(Key{name, doc}, field);
  }

  /// One word of several.
  void one_of(std::string_view name, std::string& field, std::vector<std::string_view> choices,
              const KeyDoc& doc = {}) {
    visit(Key{name, doc, {}, std::move(choices)}, field);
  }

  /// One word of several, each with its value.
  template <class E>
  void choice(std::string_view name, E& field, std::initializer_list<std::pair<std::string_view, E>> words,
              const KeyDoc& doc = {}) {
    std::vector<std::string_view> choices;
    std::string chosen;
    for (const auto& [word, value] : words) {
      choices.push_back(word);
      if (value == field) chosen = word;
    }
    one_of(name, chosen, std::move(choices), doc);
    for (const auto& [word, value] : words) {
      if (word == chosen) field = value;
    }
  }

  /// A list of whole numbers of any length.
  void whole_numbers(std::string_view name, std::vector<int>& field, KeyRange range, const KeyDoc& doc = {}) {
    visit(Key{name, doc, range}, field);
  }

  /// A list of texts of any length.
  void texts(std::string_view name, std::vector<std::string>& field, const KeyDoc& doc = {}) {
    visit(Key{name, doc}, field);
  }

  /// A list of `fields.size()` numbers.
  void numbers(std::string_view name, std::span<double> fields, KeyRange range, const KeyDoc& doc = {}) {
    visit(Key{name, doc, range}, fields);
  }

  void pairs(std::string_view name, KeyPairs& field, const KeyDoc& doc = {}) { visit(Key{name, doc}, field); }

  /// A paragraph of documentation about the keys that follow.
  virtual void note(std::string_view /*text*/) {}

 protected:
  virtual void visit(const Key& key, bool& field) = 0;
  virtual void visit(const Key& key, std::optional<double>& value) = 0;
  virtual void visit(const Key& key, std::optional<std::int64_t>& value) = 0;
  virtual void visit(const Key& key, std::string& field) = 0;
  virtual void visit(const Key& key, std::filesystem::path& field) = 0;
  virtual void visit(const Key& key, std::vector<int>& field) = 0;
  virtual void visit(const Key& key, std::vector<std::string>& field) = 0;
  virtual void visit(const Key& key, std::span<double> fields) = 0;
  virtual void visit(const Key& key, KeyPairs& field) = 0;
};

/// False for NaN.
bool is_within(double value, KeyRange range);

/// Whether `word` is one of the key's choices. A key without choices takes any word.
bool is_choice(const Key& key, std::string_view word);

/// "1 to 255".
std::string range_text(KeyRange range);

/// "one of sleep, spin".
std::string choices_text(const Key& key);

}  // namespace mocap
