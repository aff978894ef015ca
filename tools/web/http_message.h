#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mocap::web {

/// A request as this program needs it. Header values are empty if the header is absent.
struct HttpRequest {
  std::string method;  ///< "GET", "POST", ...
  std::string path;    ///< from the first / to the query, not decoded
  std::string query;   ///< after the first ?
  std::string host;
  std::string origin;
  std::string fetch_site;  ///< Sec-Fetch-Site
  std::string content_type;
  std::string authorization;
  std::string cookie;
  std::string accept_encoding;
  std::string if_none_match;
  std::string body;
  std::string remote;  ///< address and port of the client
};

/// The answer to a request. The server adds the headers that every answer has.
struct HttpReply {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};
};

/// A reply of one line of text for a person, which says what is wrong and what helps.
inline HttpReply refusal(int status, std::string sentence) {
  return {status, "text/plain; charset=utf-8", sentence += '\n'};
}

}  // namespace mocap::web
