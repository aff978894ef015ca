#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/key_visitor.h"

namespace mocap::settings {

/// One key of a table with its value.
struct ListedKey {
  Key key;
  std::string value;        ///< as a TOML file has it; "" if a number is absent
  std::string note = {};    ///< paragraph of documentation before the key
  bool is_text = false;     ///< a text, word or path: in quotes
  bool is_list = false;     ///< a list of numbers
  bool has_default = true;  ///< not an absent number, an empty text or an empty table
};

/// Lists every key of a table with its value.
class KeyList final : public KeyVisitor {
 public:
  const std::vector<ListedKey>& entries() const noexcept { return entries_; }

  void note(std::string_view text) override { note_ = text; }

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
  ListedKey& add(const Key& key, std::string value);

  std::vector<ListedKey> entries_;
  std::string note_;  // for the next key
};

}  // namespace mocap::settings
