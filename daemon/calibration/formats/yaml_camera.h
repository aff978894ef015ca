#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/formats/format_reader.h"

namespace mocap::calibration {

/// Reads values of one camera's YAML table. Faults are collected with the camera's name.
class YamlCamera {
 public:
  YamlCamera(std::string name, const YamlValue& table, FaultCollector& faults)
      : name_(std::move(name)), table_(table), faults_(faults) {}

  const std::string& name() const { return name_; }
  /// Whether no fault was added.
  bool is_valid() const { return is_valid_; }
  const YamlValue& table() const { return table_; }

  /// The value of the first of these keys that is present; null and a fault if none is.
  const YamlValue* require(std::initializer_list<const char*> keys, const char* expected);
  /// All numbers of a number, of a list, of nested lists row by row, or of a matrix with the key `data`. Nothing and a
  /// fault for other values, or if the count is none of `counts`.
  std::optional<std::vector<double>> numbers(const YamlValue& value, const char* key,
                                             std::initializer_list<std::size_t> counts);
  void add_fault(const YamlValue& at, const std::string& what);

 private:
  bool append_numbers(const YamlValue& value, std::vector<double>& numbers, const char* key);

  std::string name_;
  const YamlValue& table_;
  FaultCollector& faults_;
  bool is_valid_ = true;
};

}  // namespace mocap::calibration
