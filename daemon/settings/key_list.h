#pragma once

#include <string>
#include <utility>
#include <vector>

#include "settings/keys.h"

namespace mocap::settings {

/// A section written down: every key with the value in force, as a file would have it. An absent value is "".
class KeyList final : public Keys {
 public:
  void flag(std::string_view key, bool& field) override;
  void text(std::string_view key, std::string& field) override;
  void path(std::string_view key, std::filesystem::path& field) override;
  void one_of(std::string_view key, std::string& field, const std::vector<std::string>& words) override;
  void whole_numbers(std::string_view key, std::vector<int>& field, Range range) override;
  void texts(std::string_view key, std::vector<std::string>& field) override;
  void numbers(std::string_view key, double* fields, std::size_t count, Range range) override;
  void pairs(std::string_view key, std::vector<std::pair<std::string, std::string>>& field) override;

  const std::vector<std::pair<std::string, std::string>>& entries() const noexcept { return entries_; }

 protected:
  void real(std::string_view key, std::optional<double>& value, Range range) override;
  void whole(std::string_view key, std::optional<std::int64_t>& value, Range range) override;

 private:
  void add(std::string_view key, std::string value);

  std::vector<std::pair<std::string, std::string>> entries_;
};

}  // namespace mocap::settings
