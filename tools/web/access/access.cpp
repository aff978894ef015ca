#include "web/access/access.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <cctype>

namespace mocap::web {
namespace {

constexpr std::string_view kCookie = "mocap_token";

std::string lower(std::string_view text) {
  std::string low(text);
  for (char& c : low) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return low;
}

std::string bearer(std::string_view authorization) {
  constexpr std::string_view kScheme = "bearer ";
  if (authorization.size() <= kScheme.size() || lower(authorization.substr(0, kScheme.size())) != kScheme) return {};
  return std::string(authorization.substr(kScheme.size()));
}

std::string cookie_in(std::string_view header) {
  while (!header.empty()) {
    const std::size_t end = std::min(header.find(';'), header.size());
    std::string_view pair = header.substr(0, end);
    header.remove_prefix(std::min(end + 1, header.size()));
    pair.remove_prefix(std::min(pair.find_first_not_of(' '), pair.size()));
    if (pair.starts_with(kCookie) && pair.substr(kCookie.size()).starts_with('=')) {
      return std::string(pair.substr(kCookie.size() + 1));
    }
  }
  return {};
}

// "https://host:8443" -> "host:8443"; empty if there is no scheme, as in the origin "null".
std::string_view authority_in(std::string_view origin) {
  const std::size_t scheme = origin.find("://");
  return scheme == std::string_view::npos ? std::string_view{} : origin.substr(scheme + 3);
}

}  // namespace

std::string host_name_in(std::string_view host) {
  if (host.starts_with('[')) return std::string(host.substr(1, host.find(']') - 1));
  return lower(host.substr(0, host.find(':')));
}

bool is_address(const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> address{};
  return ::inet_pton(AF_INET, host.c_str(), address.data()) == 1 ||
         ::inet_pton(AF_INET6, host.c_str(), address.data()) == 1;
}

bool is_loopback(const std::string& address) {
  in_addr four{};
  if (::inet_pton(AF_INET, address.c_str(), &four) == 1) return ntohl(four.s_addr) >> 24U == 127;
  return address == "::1";
}

std::string token_in_query(std::string_view query) {
  while (!query.empty()) {
    const std::size_t end = std::min(query.find('&'), query.size());
    if (query.starts_with("token=")) return std::string(query.substr(6, end - 6));
    query.remove_prefix(std::min(end + 1, query.size()));
  }
  return {};
}

std::string token_cookie(const std::string& token) {
  return std::string(kCookie) + '=' + token + "; Path=/; Max-Age=31536000; HttpOnly; Secure; SameSite=Strict";
}

bool Access::is_ours(std::string_view host) const {
  const std::string name = host_name_in(host);
  return name == "localhost" || is_address(name) || std::ranges::find(settings_.names, name) != settings_.names.end();
}

std::optional<HttpReply> Access::refuse_foreign(const HttpRequest& request) const {
  if (!is_ours(request.host)) {
    return refusal(421, "Host: unknown name of this machine; use its address, or start mocap-web with --name NAME");
  }
  if (!request.origin.empty() && authority_in(lower(request.origin)) != lower(request.host)) {
    return refusal(403, "Origin: a page of another site may not use this server");
  }
  if (request.fetch_site == "cross-site" || request.fetch_site == "same-site") {
    const bool opens_page = request.method == "GET" && !request.path.starts_with("/api/") && request.path != "/ws";
    if (!opens_page) return refusal(403, "Sec-Fetch-Site: a page of another site may not use this server");
  }
  return std::nullopt;
}

std::optional<HttpReply> Access::refuse_foreign_reader(const HttpRequest& request) const {
  if (std::ranges::find(settings_.origins, lower(request.origin)) != settings_.origins.end()) return std::nullopt;
  auto refused = refuse_foreign(request);
  if (refused && refused->status == 403) {
    refused->body += "mocap-web --origin " + request.origin + " permits its pages to read the feed\n";
  }
  return refused;
}

std::optional<Visitor> Access::visitor(const HttpRequest& request) const {
  if (settings_.open) return Visitor{settings_.role_without_token, "local"};
  for (const std::string& given :
       {bearer(request.authorization), cookie_in(request.cookie), token_in_query(request.query)}) {
    if (given.empty()) continue;
    if (const Token* known = find_token(settings_.tokens, given)) return Visitor{known->role, known->name};
  }
  return std::nullopt;
}

}  // namespace mocap::web
