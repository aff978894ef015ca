#pragma once

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <charconv>
#include <cstdint>
#include <string>
#include <utility>

#include "web/http/any_stream.h"
#include "web/http_message.h"

namespace mocap::web {

/// The page loads only its own files, talks only to this server, and cannot be shown within another page.
inline constexpr const char* kContentPolicy =
    "default-src 'self'; img-src 'self' blob: data:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

inline std::string text_of(beast::string_view text) { return {text.data(), text.size()}; }

inline HttpRequest request_of(const http::request<http::string_body>& raw, const std::string& remote) {
  const auto header = [&](http::field name) { return text_of(raw[name]); };
  HttpRequest request;
  request.method = text_of(raw.method_string());
  const std::string target = text_of(raw.target());
  const std::size_t query = target.find('?');
  request.path = target.substr(0, query);
  if (query != std::string::npos) request.query = target.substr(query + 1);
  request.host = header(http::field::host);
  request.origin = header(http::field::origin);
  request.fetch_site = text_of(raw["Sec-Fetch-Site"]);
  request.content_type = header(http::field::content_type);
  const std::string length = header(http::field::content_length);
  std::from_chars(length.data(), length.data() + length.size(), request.content_length);
  request.authorization = header(http::field::authorization);
  request.cookie = header(http::field::cookie);
  request.accept_encoding = header(http::field::accept_encoding);
  request.if_none_match = header(http::field::if_none_match);
  request.body = raw.body();
  request.remote = remote;
  return request;
}

inline http::response<http::string_body> response_of(HttpReply&& reply,
                                                     const http::request<http::string_body>& request) {
  http::response<http::string_body> response{static_cast<http::status>(reply.status), request.version()};
  response.set(http::field::content_type, reply.content_type);
  response.set("Content-Security-Policy", kContentPolicy);
  response.set("X-Content-Type-Options", "nosniff");
  response.set("Referrer-Policy", "no-referrer");
  response.set("Cross-Origin-Opener-Policy", "same-origin");
  response.set("Cross-Origin-Resource-Policy", "same-origin");
  response.set(http::field::cache_control, "no-store");
  for (const auto& [name, value] : reply.headers) response.set(name, value);
  response.keep_alive(request.keep_alive());
  const std::uint64_t size = reply.stream ? reply.stream->size() : reply.body.size();
  if (request.method() != http::verb::head) response.body() = std::move(reply.body);
  response.prepare_payload();
  if (reply.stream || request.method() == http::verb::head) response.content_length(size);
  return response;
}

}  // namespace mocap::web
