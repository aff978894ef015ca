#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "web/access/tokens.h"
#include "web/http_message.h"
#include "wire/role.h"

namespace mocap::web {

struct AccessSettings {
  bool open = true;  ///< without tokens: every client has the role `role_without_token`
  wire::Role role_without_token = wire::Role::Operator;
  std::vector<Token> tokens = {};
  std::vector<std::string> origins = {};  ///< other sites whose pages may read the feed, "https://HOST"
  std::vector<std::string> names = {};    ///< host names of this machine, beside localhost and its addresses
};

/// A client that may be answered.
struct Visitor {
  wire::Role role = wire::Role::Viewer;
  std::string name;  ///< of the token; "local" without tokens
};

/// Decides who may ask for what. Pure.
class Access {
 public:
  explicit Access(AccessSettings settings) : settings_(std::move(settings)) {}

  /// Refuses requests that a page of another site made the browser send: a host name that is not this machine's (DNS
  /// rebinding), an Origin or Sec-Fetch-Site of another site. Empty: permitted.
  std::optional<HttpReply> refuse_foreign(const HttpRequest& request) const;

  /// The same for a connection that only reads the feed: the sites of `origins` may open it.
  std::optional<HttpReply> refuse_foreign_reader(const HttpRequest& request) const;

  /// The client's role, by its token: header "Authorization: Bearer TOKEN", cookie, or ?token=TOKEN. Empty: unknown
  /// token or none.
  std::optional<Visitor> visitor(const HttpRequest& request) const;

 private:
  bool is_ours(std::string_view host) const;

  AccessSettings settings_;
};

/// The value of ?token=...; empty if there is none.
std::string token_in_query(std::string_view query);

/// The cookie that keeps the token in the browser.
std::string token_cookie(const std::string& token);

/// The name in a Host header: without port, and without the brackets of an IPv6 address.
std::string host_name_in(std::string_view host);

/// Whether `host` is an IPv4 or IPv6 address. An attacker's DNS name can lead to this machine, an address cannot.
bool is_address(const std::string& host);
/// Whether only this machine reaches a server that listens at this address.
bool is_loopback(const std::string& address);

}  // namespace mocap::web
