#pragma once

#include <cstdint>
#include <functional>
#include <memory>
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
  std::uint64_t content_length = 0;  ///< as the client says; 0: unknown
  std::string authorization;
  std::string cookie;
  std::string accept_encoding;
  std::string if_none_match;
  std::string body;
  std::string remote;  ///< address and port of the client
};

/// A body that is too large for the memory.
class ByteStream {
 public:
  virtual ~ByteStream() = default;
  virtual std::uint64_t size() const = 0;
  /// Calls `take` with the next piece, now or later. Empty: the end, or the bytes cannot be read.
  virtual void next(std::function<void(std::string piece)> take) = 0;
};

/// The answer to a request. The server adds the headers that every answer has.
struct HttpReply {
  int status = 200;
  std::string content_type = "text/plain; charset=utf-8";
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::shared_ptr<ByteStream> stream = nullptr;  ///< instead of `body`
};

/// A reply of one line of text for a person, which says what is wrong and what helps.
inline HttpReply refusal(int status, std::string sentence) {
  return {status, "text/plain; charset=utf-8", sentence += '\n'};
}

}  // namespace mocap::web
