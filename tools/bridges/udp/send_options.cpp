#include "bridges/udp/send_options.h"

#include <algorithm>

namespace mocap::bridge {
namespace {

bool is_port(std::string_view text) {
  constexpr std::size_t kDigits = 5;
  return !text.empty() && text.size() <= kDigits &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

}  // namespace

std::optional<Target> read_target(std::string_view text, const std::string& port) {
  std::string_view host = text;
  std::string_view own;
  const std::size_t colon = text.rfind(':');
  const bool bracketed = text.starts_with('[');
  // Several colons without brackets are an IPv6 address without a port.
  if (bracketed ? colon != std::string_view::npos && colon > text.find(']') : colon == text.find(':')) {
    host = text.substr(0, colon);
    if (colon != std::string_view::npos) own = text.substr(colon + 1);
    if (colon != std::string_view::npos && !is_port(own)) return std::nullopt;
  }
  if (bracketed && (host.size() < 2 || host.back() != ']')) return std::nullopt;
  if (bracketed) host = host.substr(1, host.size() - 2);
  if (host.empty()) return std::nullopt;
  return Target{std::string(host), own.empty() ? port : std::string(own)};
}

void add_send_options(cli::App& app, SendOptions& options) {
  app.add_option("endpoint", options.feed.endpoint, "the feed")->capture_default_str();
  app.add_option("--to", options.to, "host of a receiver, or HOST:PORT; may be repeated")
      ->one_value_each()
      ->type_name("HOST")
      ->capture_default_str();
  app.add_option("--port", options.port, "UDP port of the receivers that are given without a port")
      ->capture_default_str();
  app.add_option("--rate", options.rate_hz, "largest frame rate, Hz")
      ->check(cli::Range(1.0, 1000.0))
      ->capture_default_str();
  app.add_option(
         "--status-file", options.status_file,
         "write the statistics to this file once a second; without it, to a file that mocapctl bridge list reads")
      ->type_name("FILE");
  app.add_option("--seconds", options.seconds, "end after this time")->check(cli::PositiveNumber{});
  cli::add_key_options(app, options.keys);
}

}  // namespace mocap::bridge
