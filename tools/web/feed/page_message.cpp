#include "web/feed/page_message.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "lib/json_depth.h"
#include "web/feed/topics.h"

namespace mocap::web {
namespace {

using nlohmann::json;

Error invalid(std::string why) { return {ErrorCode::InvalidArgument, std::move(why)}; }

Result<PageMessage> read_subscribe(const json& list) {
  if (!list.is_array()) return invalid("subscribe: expected a list of topics");
  if (list.size() > kMaxTopics)
    return invalid(fmt::format("subscribe: {} topics, expected at most {}", list.size(), kMaxTopics));
  SubscribeMessage message;
  for (const json& topic : list) {
    const auto* text = topic.get_ptr<const std::string*>();
    if (text == nullptr || !is_topic(*text)) {
      return invalid(
          "subscribe: expected description, snapshot, health, event, markers, sightings, preview/NAME or subject/NAME "
          "in the "
          "list");
    }
    message.topics.insert(*text);
  }
  return PageMessage(std::move(message));
}

Result<PageMessage> read_request(const json& request) {
  if (!request.is_object()) return invalid("request: expected an object with id, method and params");
  RequestMessage message;
  const auto id = request.find("id");
  const auto method = request.find("method");
  if (id == request.end() || !id->is_number_unsigned()) return invalid("request: id: expected a number from 0");
  if (method == request.end() || !method->is_string()) return invalid("request: method: expected a name");
  message.id = id->get<std::uint64_t>();
  message.method = method->get<std::string>();
  if (const auto params = request.find("params"); params != request.end()) {
    if (!params->is_object()) return invalid("request: params: expected an object");
    message.params = params->dump(-1, ' ', false, json::error_handler_t::replace);
  }
  return PageMessage(std::move(message));
}

// JSON text of a string, with invalid UTF-8 replaced.
std::string quoted(std::string_view text) {
  return json(std::string(text)).dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace

Result<PageMessage> read_page_message(std::string_view text) {
  if (is_deep(text)) return invalid(fmt::format("expected at most {} nested brackets", kMaxJsonDepth));
  const json message = json::parse(text, nullptr, false);
  if (!message.is_object() || message.size() != 1) {
    return invalid("expected a JSON object with one of subscribe, drawn, request");
  }
  const auto first = message.begin();
  if (first.key() == "subscribe") return read_subscribe(first.value());
  if (first.key() == "drawn") return PageMessage(DrawnMessage{});
  if (first.key() == "request") return read_request(first.value());
  return invalid("expected a JSON object with one of subscribe, drawn, request");
}

std::string answer_text(std::uint64_t id, std::string_view result) {
  return fmt::format(R"({{"answer":{{"id":{},"ok":true,"result":{}}}}})", id, result);
}

std::string error_text(std::uint64_t id, std::string_view code, std::string_view message) {
  return fmt::format(R"({{"answer":{{"id":{},"ok":false,"error":{{"code":{},"message":{}}}}}}})", id, quoted(code),
                     quoted(message));
}

}  // namespace mocap::web
