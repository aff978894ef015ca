#include "bridges/relay/server.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/read_file.h"
#include "wire/curve_keys.h"

namespace mocap::relay {
namespace {

constexpr std::string_view kJwtBegins = "-----BEGIN NATS USER JWT";
constexpr std::size_t kLongestSecret = 4096;

bool is_port(std::string_view text) {
  return !text.empty() && text.size() <= 5 && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

bool is_host(std::string_view text) {
  // An address in brackets has colons; no host has the other characters, which have a meaning in a URL.
  return !text.empty() && text.find_first_of("@/?# \t,") == std::string_view::npos &&
         (text.find(':') == std::string_view::npos || (text.front() == '[' && text.back() == ']' && text.size() > 2));
}

bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c < '\x7f'; });
}

Error no_credentials(const std::filesystem::path& path, std::string_view fault) {
  return Error{ErrorCode::InvalidArgument,
               fmt::format("{}: {}; expected a credentials file of NATS, a line USER:PASSWORD, or a line with a token",
                           path.string(), fault)};
}

}  // namespace

std::string Server::url() const { return fmt::format("{}://{}:{}", tls ? "tls" : "nats", host, port); }

bool Server::is_local() const { return host.starts_with("127.") || host == "localhost" || host == "[::1]"; }

std::optional<Server> read_server(std::string_view text) {
  constexpr std::string_view kTls = "tls://", kPlain = "nats://";
  Server server;
  const bool says_tls = text.starts_with(kTls), says_plain = text.starts_with(kPlain);
  if (says_tls) text.remove_prefix(kTls.size());
  if (says_plain) text.remove_prefix(kPlain.size());
  const std::size_t colon = text.rfind(':');
  const std::size_t bracket = text.rfind(']');
  const bool has_port = colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket);
  server.host = text.substr(0, has_port ? colon : text.size());
  if (has_port) server.port = text.substr(colon + 1);
  if (!is_host(server.host) || !is_port(server.port)) return std::nullopt;
  server.tls = says_tls || (!says_plain && !server.is_local());
  return server;
}

Result<Credentials> read_credentials(const std::filesystem::path& path) {
  Result<std::string> read = read_file(path);
  if (!read) return Error{ErrorCode::NotFound, fmt::format("{}: no such file, or it may not be read", path.string())};
  if (const Status closed = wire::check_private(path); !closed) return closed.error();
  std::string text = *std::move(read);
  if (text.starts_with(kJwtBegins)) return Credentials{.jwt = path};
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  if (text.empty()) return no_credentials(path, "is empty");
  if (text.size() > kLongestSecret || !is_printable(text)) return no_credentials(path, "has another content");
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return Credentials{.token = text};
  return Credentials{.user = text.substr(0, colon), .password = text.substr(colon + 1)};
}

}  // namespace mocap::relay
