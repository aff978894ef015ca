#pragma once

#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <variant>

#include "base/result.h"

namespace mocap::web {

/// {"subscribe":["snapshot",...]}: replaces the list of topics.
struct SubscribeMessage {
  std::set<std::string, std::less<>> topics;
};
/// {"drawn":FRAME}: the page has drawn the snapshot that was sent last.
struct DrawnMessage {};
/// {"request":{"id":N,"method":"METHOD","params":{...}}}
struct RequestMessage {
  std::uint64_t id = 0;
  std::string method;
  std::string params = "{}";  ///< JSON
};
using PageMessage = std::variant<SubscribeMessage, DrawnMessage, RequestMessage>;

/// Reads a text that a page sent. Fails with InvalidArgument; the message says what is expected.
Result<PageMessage> read_page_message(std::string_view text);

/// {"answer":{"id":N,"ok":true,"result":ANSWER}} with the JSON `result`.
std::string answer_text(std::uint64_t id, std::string_view result);
/// {"answer":{"id":N,"ok":false,"error":{"code":...,"message":...}}}
std::string error_text(std::uint64_t id, std::string_view code, std::string_view message);

}  // namespace mocap::web
