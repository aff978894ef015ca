#include "ctl/audit/audit_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostOlder = 100;  // [audit] keep

std::string rfc3339(std::int64_t utc_s) {
  const std::time_t seconds = utc_s;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}", parts.tm_year + 1900, parts.tm_mon + 1, parts.tm_mday,
                     parts.tm_hour, parts.tm_min, parts.tm_sec);
}

std::optional<std::int64_t> unit_s(char unit) {
  switch (unit) {
    case 's': return 1;
    case 'm': return 60;
    case 'h': return 3600;
    case 'd': return 86400;
    default: return std::nullopt;
  }
}

bool is_date(const std::string& text) {
  constexpr std::string_view kForm = "0000-00-00T00:00:00Z";
  if (text.size() != 10 && text.size() != kForm.size() && text.size() + 1 != kForm.size()) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool digit = text[i] >= '0' && text[i] <= '9';
    if (kForm[i] == '0' ? !digit : text[i] != kForm[i]) return false;
  }
  return true;
}

std::optional<AuditLine> parse(const std::string& text) {
  const auto json = nlohmann::ordered_json::parse(text, nullptr, false);
  if (!json.is_object()) return std::nullopt;
  AuditLine line;
  line.json = text;
  for (const auto& [name, value] : json.items()) {
    if (!value.is_string()) return std::nullopt;
    const auto& words = value.get_ref<const std::string&>();
    if (name == "at") {
      line.at = words;
    } else if (name == "what") {
      line.what = words;
    } else if (name == "who") {
      line.who = words;
    } else {
      line.parts.emplace_back(name, words);
    }
  }
  if (line.at.empty() || line.what.empty() || line.who.empty()) return std::nullopt;
  return line;
}

bool is_of(const AuditLine& line, const std::string& who) {
  if (line.who == who) return true;
  return std::ranges::any_of(line.parts, [&](const auto& part) {
    if (part.first == "from") return part.second.starts_with(who);
    return (part.first == "states" || part.first == "key") && part.second == who;
  });
}

bool selects(const AuditFilter& filter, const AuditLine& line) {
  return line.at >= filter.since && (filter.what.empty() || line.what == filter.what) &&
         (filter.who.empty() || is_of(line, filter.who));
}

// The log and its older files, the oldest first.
std::vector<fs::path> files_of(const fs::path& file) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (std::size_t number = kMostOlder; number > 0; --number) {
    const fs::path older = fmt::format("{}.{}", file.string(), number);
    if (fs::exists(older, ignored)) files.push_back(older);
  }
  if (fs::exists(file, ignored)) files.push_back(file);
  return files;
}

}  // namespace

std::optional<std::string> since_text(const std::string& text, std::int64_t now_utc_s) {
  if (is_date(text)) return text.ends_with('Z') ? text.substr(0, text.size() - 1) : text;
  std::int64_t count = 0;
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (fault != std::errc{} || end + 1 != text.data() + text.size() || count < 0 || count > 1'000'000)
    return std::nullopt;
  const auto unit = unit_s(*end);
  if (!unit) return std::nullopt;
  return rfc3339(std::max<std::int64_t>(now_utc_s - count * *unit, 0));
}

Result<std::uint64_t> read_audit(const fs::path& file, const AuditFilter& filter,
                                 const std::function<void(const AuditLine&)>& show) {
  const std::vector<fs::path> files = files_of(file);
  if (files.empty()) return Error{ErrorCode::NotFound, file.string() + ": no such file"};
  std::uint64_t damaged = 0;
  for (const fs::path& each : files) {
    std::ifstream stream(each);
    if (!stream) {
      return Error{ErrorCode::Io,
                   fmt::format("{}: {}", each.string(), std::strerror(errno))};  // NOLINT(concurrency-mt-unsafe)
    }
    for (std::string text; std::getline(stream, text);) {
      const auto line = parse(text);
      damaged += line || text.empty() ? 0 : 1;
      if (line && selects(filter, *line)) show(*line);
    }
  }
  return damaged;
}

}  // namespace mocap::ctl
