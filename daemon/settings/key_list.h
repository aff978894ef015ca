#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/key_visitor.h"

namespace mocap::settings {

/// Lists every key of a table with its value, as a file would have it. An absent value is "".
class KeyList final : public KeyVisitor {
 public:
  const std::vector<std::pair<std::string, std::string>>& entries() const noexcept { return entries_; }

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
  void add(const Key& key, std::string value);

  std::vector<std::pair<std::string, std::string>> entries_;
};

}  // namespace mocap::settings
