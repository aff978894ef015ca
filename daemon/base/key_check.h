#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/key_visitor.h"

namespace mocap {

/// Compares the values of a settings struct with the ranges and choices of its keys. Changes nothing and looks at no
/// file: `required` and `must_exist` are rules about files.
class KeyCheck final : public KeyVisitor {
 public:
  const std::vector<KeyFault>& faults() const noexcept { return faults_; }

 protected:
  void visit(const Key& key, bool& field) override;
  void visit(const Key& key, std::optional<double>& value) override;
  void visit(const Key& key, std::optional<std::int64_t>& value) override;
  void visit(const Key& key, std::string& field) override;
  void visit(const Key& key, std::filesystem::path& field) override;
  void visit(const Key& key, std::vector<int>& field) override;
  void visit(const Key& key, std::vector<std::string>& field) override;
  void visit(const Key& key, std::span<double> fields) override;
  void visit(const Key& key, KeyPairs& field) override;

 private:
  void expect_within(const Key& key, double value);

  std::vector<KeyFault> faults_;
};

/// The keys of `settings` whose values are outside of their ranges or choices.
template <class Settings>
std::vector<KeyFault> check_keys(Settings settings) {
  KeyCheck check;
  declare_keys(check, settings);
  return check.faults();
}

}  // namespace mocap
