#include "audit/audit_line.h"

#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <string_view>

namespace mocap::audit {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

// "2026-11-26T18:15:20.123456Z".
std::string utc_text(std::int64_t utc_ns) {
  const std::time_t seconds = utc_ns / kSecond_ns;
  std::tm parts{};
  ::gmtime_r(&seconds, &parts);
  return fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:06}Z", parts.tm_year + 1900, parts.tm_mon + 1,
                     parts.tm_mday, parts.tm_hour, parts.tm_min, parts.tm_sec, utc_ns % kSecond_ns / 1000);
}

// The length of the UTF-8 sequence that begins with `first`, by its leading bits; 0: none begins so.
std::size_t length_by(unsigned char first) {
  if (first >= 0xC2U && first <= 0xDFU) return 2;
  if (first >= 0xE0U && first <= 0xEFU) return 3;
  if (first >= 0xF0U && first <= 0xF4U) return 4;
  return 0;
}

// The length of the well-formed sequence at the begin of `text`; 0: it is malformed. Source: The Unicode Standard,
// table 3-7, in which only the second byte has further bounds.
std::size_t sequence_at(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const std::size_t length = length_by(byte(0));
  if (length == 0 || length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
  }
  const bool overlong = (byte(0) == 0xE0U && byte(1) < 0xA0U) || (byte(0) == 0xF0U && byte(1) < 0x90U);
  const bool no_character = (byte(0) == 0xEDU && byte(1) > 0x9FU) || (byte(0) == 0xF4U && byte(1) > 0x8FU);
  return overlong || no_character ? 0 : length;
}

std::string json_text(std::string_view text) {
  std::string json = "\"";
  for (std::size_t i = 0; i < text.size();) {
    if (i >= kLongestValue) {
      json += "...";
      break;
    }
    const auto byte = static_cast<unsigned char>(text[i]);
    const std::size_t sequence = byte < 0x80U ? 0 : sequence_at(text.substr(i));
    if (sequence > 0) {
      json += text.substr(i, sequence);
    } else if (byte == '"' || byte == '\\') {
      json += {'\\', text[i]};
    } else if (byte < 0x20U || byte == 0x7FU) {
      json += fmt::format("\\u{:04x}", byte);
    } else {
      json += byte < 0x80U ? text[i] : '?';
    }
    i += sequence > 0 ? sequence : 1;
  }
  return json + '"';
}

std::string who_of(const AuditActor& actor) {
  if (!actor.name.empty()) return actor.name;
  if (!actor.key.empty()) return actor.key;
  if (!actor.address.empty()) return actor.address.substr(0, actor.address.rfind(':'));
  return "mocapd";
}

}  // namespace

std::string to_line(const AuditEntry& entry) {
  std::string line = fmt::format("{{\"at\":\"{}\",\"what\":{},\"who\":{}", utc_text(entry.at_utc_ns),
                                 json_text(entry.what), json_text(who_of(entry.who)));
  const auto add = [&](std::string_view name, std::string_view value) {
    if (!value.empty()) line += fmt::format(",{}:{}", json_text(name), json_text(value));
  };
  add("states", entry.who.states);
  add("role", entry.who.role);
  add("from", entry.who.address);
  add("key", entry.who.key);
  for (const auto& [name, value] : entry.details) add(name, value);
  return line + "}\n";
}

}  // namespace mocap::audit
