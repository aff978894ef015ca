#pragma once

#include <string>
#include <vector>

#include "calibrate/formats_reader.h"

namespace mocap::calibrate {

/// Reads one camera's table of a YAML file and complains in that camera's name.
class YamlCamera {
 public:
  YamlCamera(std::string name, const YamlValue& table, Complaints& complaints)
      : name_(std::move(name)), table_(table), complaints_(complaints) {}

  const std::string& name() const { return name_; }
  void call(std::string name) { name_ = std::move(name); }
  bool sound() const { return sound_; }
  const YamlValue& table() const { return table_; }

  /// The value of one of these keys; a complaint where there is none.
  const YamlValue* require(std::initializer_list<const char*> keys, const char* expected);
  /// All numbers of a list, of lists in a list row by row, or of a matrix with `data`; one number alone, too. Nothing,
  /// and a complaint, where it is something else or where their count is none of `counts`.
  std::optional<std::vector<double>> numbers(const YamlValue& value, const char* key,
                                             std::initializer_list<std::size_t> counts);
  void complain(const YamlValue& at, const std::string& what);

 private:
  bool gather(const YamlValue& value, std::vector<double>& into, const char* key);

  std::string name_;
  const YamlValue& table_;
  Complaints& complaints_;
  bool sound_ = true;
};

}  // namespace mocap::calibrate
