#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/result.h"

namespace mocap::ctl {

/// One line of the audit log.
struct AuditLine {
  std::string at;  ///< UTC, RFC 3339
  std::string what, who;
  std::vector<std::pair<std::string, std::string>> parts;  ///< the other names and values, in their order
  std::string json;                                        ///< the line as it stands in the file
};

/// Selects lines. An empty text selects all.
struct AuditFilter {
  std::string since = {};  ///< UTC, RFC 3339: lines from then on
  std::string who = {};    ///< the name, the stated name, the key, or the begin of the address
  std::string what = {};
};

/// "2h", "30m", "7d", "90s" before `now_utc_s`, or "2026-11-26" with or without "T18:15:20Z", as RFC 3339 in UTC.
/// Nothing: neither.
std::optional<std::string> since_text(const std::string& text, std::int64_t now_utc_s);

/// Calls `show` for each selected line of the log and of its older files (FILE.2, FILE.1, FILE), the oldest first.
/// Returns the number of lines that are no lines of an audit log. Fails with NotFound if there is no file, and with Io.
Result<std::uint64_t> read_audit(const std::filesystem::path& file, const AuditFilter& filter,
                                 const std::function<void(const AuditLine&)>& show);

}  // namespace mocap::ctl
