#include "cameras/ptp/pmc_answer.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string>
#include <vector>

namespace mocap::cameras {
namespace {

using Words = std::vector<std::string_view>;

Words words_of(std::string_view line) {
  Words words;
  for (std::size_t begin = 0; (begin = line.find_first_not_of(" \t\r", begin)) != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(" \t\r", begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = end;
  }
  return words;
}

template <class Integer>
std::optional<Integer> integer(std::string_view text, int base = 10) {
  Integer value{};
  const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (fault != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// 7adcdf.fffe.341041
std::optional<std::uint64_t> identity(std::string_view text) {
  std::string digits(text);
  std::erase(digits, '.');
  return digits.size() == 16 ? integer<std::uint64_t>(digits, 16) : std::nullopt;
}

struct Fields {
  std::optional<std::int64_t> offset_ns, measured_ns;
  std::optional<std::uint64_t> grandmaster;
  bool has_master = false;
  std::vector<std::string_view> ports;  // their states
};

void read_line(const Words& words, Fields& fields) {
  if (words.size() != 2) return;
  const std::string_view name = words[0], value = words[1];
  if (name == "master_offset") fields.offset_ns = integer<std::int64_t>(value);
  if (name == "ingress_time") fields.measured_ns = integer<std::int64_t>(value);
  if (name == "gmPresent") fields.has_master = value == "true";
  if (name == "gmIdentity") fields.grandmaster = identity(value);
  if (name == "portState") fields.ports.push_back(value);
}

// The first line that reports something else than that a question was sent, without the instant in "pmc[4823.123]: ";
// empty if there is none. A lasting fault has one text, so that it is logged once.
std::string_view first_report(std::string_view text) {
  constexpr std::size_t kLongest = 200;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    if (line.starts_with("pmc[")) line.remove_prefix(std::min(line.find(' '), line.size()));
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r"), line.size()));
    if (!line.empty() && !line.starts_with("sending:")) return line.substr(0, kLongest);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return {};
}

bool is_master(std::string_view state) { return state == "MASTER" || state == "GRAND_MASTER"; }

}  // namespace

Result<PmcAnswer> parse_pmc(std::string_view text) {
  const std::string_view report = first_report(text);
  Fields fields;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    read_line(words_of(text.substr(0, end)), fields);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  if (!fields.offset_ns || !fields.measured_ns || !fields.grandmaster) {
    return Error{ErrorCode::NotFound, report.empty() ? std::string("ptp4l does not answer")
                                                     : fmt::format("ptp4l does not answer; pmc prints: {}", report)};
  }
  if (fields.has_master) {
    return PmcAnswer{*fields.grandmaster, Duration{*fields.offset_ns}, Duration{*fields.measured_ns}};
  }
  if (std::ranges::any_of(fields.ports, is_master)) return PmcAnswer{*fields.grandmaster, Duration{}, std::nullopt};
  return Error{ErrorCode::NotFound,
               fmt::format("ptp4l has no master: its ports are {}", fmt::join(fields.ports, ", "))};
}

}  // namespace mocap::cameras
