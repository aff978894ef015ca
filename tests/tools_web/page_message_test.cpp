#include "web/feed/page_message.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace mocap::web {
namespace page_message_test {

TEST(PageMessage, ReadsTheListOfTopics) {
  const auto message = read_page_message(R"({"subscribe":["snapshot","preview/north","snapshot"]})");

  ASSERT_TRUE(message);
  EXPECT_THAT(std::get<SubscribeMessage>(*message).topics, testing::ElementsAre("preview/north", "snapshot"));
}

TEST(PageMessage, ReadsThatASnapshotWasDrawn) {
  EXPECT_TRUE(std::holds_alternative<DrawnMessage>(*read_page_message(R"({"drawn":17})")));
}

TEST(PageMessage, ReadsARequestWithItsParametersAsJson) {
  const auto message = read_page_message(R"({"request":{"id":7,"method":"take","params":{"action":"ACTION_STOP"}}})");

  ASSERT_TRUE(message);
  const auto& request = std::get<RequestMessage>(*message);
  EXPECT_EQ(request.id, 7U);
  EXPECT_EQ(request.method, "take");
  EXPECT_EQ(nlohmann::json::parse(request.params)["action"], "ACTION_STOP");
}

TEST(PageMessage, RefusesWhatIsNoMessage) {
  const std::string many = R"({"subscribe":[)" + [] {
    std::string list;
    for (int i = 0; i < 97; ++i) list += (i > 0 ? "," : "") + std::string("\"snapshot\"");
    return list;
  }() + "]}";
  for (const std::string& text :
       {std::string(), std::string("{}"), std::string("[]"), std::string("{\"drawn\":1,\"subscribe\":[]}"),
        std::string(R"({"subscribe":["secret"]})"), std::string(R"({"subscribe":"snapshot"})"),
        std::string(R"({"subscribe":[1]})"), std::string(R"({"request":{"id":-1,"method":"take"}})"),
        std::string(R"({"request":{"id":1}})"), std::string(R"({"request":{"id":1,"method":"take","params":[]}})"),
        std::string(R"({"other":1})"), many}) {
    const auto message = read_page_message(text);
    ASSERT_FALSE(message) << text;
    EXPECT_THAT(message.error().message, testing::HasSubstr("expected")) << text;
  }
}

TEST(PageMessage, RefusesDeepNestingWithoutRecursion) {
  const std::string deep = R"({"request":{"id":1,"method":"take","params":{"a":)" + std::string(60000, '[') + "}}}";

  EXPECT_FALSE(read_page_message(deep));
}

TEST(PageMessage, WritesAnswersThatAreJson) {
  const auto answer = nlohmann::json::parse(answer_text(3, R"({"code":"CODE_DONE"})"));
  const auto error = nlohmann::json::parse(error_text(4, "CODE_FAILED", "a \"quoted\" \xFF word"));

  EXPECT_EQ(answer["answer"]["id"], 3);
  EXPECT_EQ(answer["answer"]["ok"], true);
  EXPECT_EQ(answer["answer"]["result"]["code"], "CODE_DONE");
  EXPECT_EQ(error["answer"]["ok"], false);
  EXPECT_EQ(error["answer"]["error"]["code"], "CODE_FAILED");
}

}  // namespace page_message_test
}  // namespace mocap::web
