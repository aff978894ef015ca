#include "web/api.h"

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "model/control.h"
#include "web/openapi.h"

namespace mocap::web {
namespace api_test {

using nlohmann::json;

TEST(Api, HasEveryRequestOfTheControlProtocol) {
  EXPECT_EQ(static_cast<int>(methods().size()), v1::Request::descriptor()->FindOneofByName("what")->field_count());
  ASSERT_NE(find_method("take"), nullptr);
  EXPECT_TRUE(find_method("take")->changes);
  ASSERT_NE(find_method("status"), nullptr);
  EXPECT_FALSE(find_method("status")->changes);
  EXPECT_EQ(find_method("id"), nullptr);
  EXPECT_EQ(find_method(""), nullptr);
}

TEST(Api, MakesARequestFromJson) {
  const auto request = request_of(*find_method("take"), R"({"action":"ACTION_START","slate":"walk","beforeS":2})");

  ASSERT_TRUE(request) << request.error().message;
  EXPECT_EQ(request->take().action(), v1::TakeRequest::ACTION_START);
  EXPECT_EQ(request->take().slate(), "walk");
  EXPECT_EQ(request->take().before_s(), 2.0);
}

TEST(Api, MakesARequestWithoutParameters) {
  for (const char* nothing : {"", "{}", " \n"}) {
    const auto request = request_of(*find_method("reload"), nothing);
    ASSERT_TRUE(request) << nothing;
    EXPECT_TRUE(request->has_reload());
  }
}

TEST(Api, NamesTheFaultOfParameters) {
  for (const char* faulty : {R"({"acton":"ACTION_START"})", R"({"action":"JUMP"})", "[]", "{", R"({"beforeS":"x"})"}) {
    const auto request = request_of(*find_method("take"), faulty);
    ASSERT_FALSE(request) << faulty;
    EXPECT_THAT(request.error().message, testing::HasSubstr("TakeRequest")) << faulty;
  }
}

TEST(Api, LetsAViewerListTheMasks) {
  const Method& mask = *find_method("mask");
  EXPECT_FALSE(is_change(mask, *request_of(mask, R"({"action":"ACTION_LIST"})")));
  for (const char* changing : {R"({"action":"ACTION_DRAW"})", R"({"action":"ACTION_FORGET"})", "{}"}) {
    EXPECT_TRUE(is_change(mask, *request_of(mask, changing))) << changing;
  }
}

TEST(Api, GivesCamerasTheTimeToDeliverTheImagesOfAMask) {
  const Method &mask = *find_method("mask"), &take = *find_method("take"), &status = *find_method("status");
  const auto learn = request_of(mask, R"({"action":"ACTION_LEARN","images":300})");
  const auto learn_at_all = request_of(mask, "{}");
  const auto draw = request_of(mask, R"({"action":"ACTION_DRAW"})");

  EXPECT_TRUE(is_learning(*learn));
  EXPECT_TRUE(is_learning(*learn_at_all));
  EXPECT_FALSE(is_learning(*draw));
  EXPECT_FALSE(is_learning(*request_of(take, "{}")));
  EXPECT_GT(patience_of(mask, *learn), longest_learning(300));
  EXPECT_GT(patience_of(mask, *learn_at_all), longest_learning(kDefaultMaskImages));
  EXPECT_LT(patience_of(mask, *draw), std::chrono::minutes(1));
  EXPECT_LT(patience_of(status, *request_of(status, "{}")), patience_of(take, *request_of(take, "{}")));
}

TEST(Api, LetsAViewerListTheShots) {
  const Method& shots = *find_method("shots");
  EXPECT_FALSE(is_change(shots, *request_of(shots, R"({"action":"ACTION_LIST"})")));
  EXPECT_TRUE(is_change(shots, *request_of(shots, R"({"action":"ACTION_CLEAR"})")));
  EXPECT_TRUE(is_change(shots, *request_of(shots, "{}")));

  const Method& take = *find_method("take");
  EXPECT_TRUE(is_change(take, *request_of(take, "{}")));
}

TEST(Api, WritesTheParametersForTheAuditLogInOneLine) {
  auto request = request_of(*find_method("take"), R"({"action":"ACTION_MARK","text":"two\nlines"})");

  EXPECT_EQ(params_of(*request), R"({"action":"ACTION_MARK","text":"two\nlines"})");
}

TEST(Api, WritesFieldsWithTheirDefaults) {
  v1::Answer answer;
  answer.set_code(v1::CODE_DONE);
  answer.mutable_status()->set_capturing(false);

  EXPECT_EQ(json::parse(json_of(answer))["status"]["capturing"], false);
}

TEST(Api, GivesEachCodeItsStatus) {
  EXPECT_EQ(http_status_of(v1::CODE_DONE), 200);
  EXPECT_EQ(http_status_of(v1::CODE_FORBIDDEN), 403);
  EXPECT_EQ(http_status_of(v1::CODE_FAILED), 502);
  EXPECT_EQ(http_status_of(static_cast<v1::Code>(99)), 502);
}

TEST(OpenApi, DescribesEveryMethodAndResolvesEveryReference) {
  const json all = json::parse(openapi_json());

  for (const Method& method : methods()) {
    const json& path = all["paths"]["/api/v1/" + method.name];
    EXPECT_TRUE(path.contains(method.changes ? "post" : "get")) << method.name;
  }
  EXPECT_EQ(all["paths"]["/api/v1/takes/{name}/export"]["get"]["parameters"].size(), 8U);
  EXPECT_TRUE(all["paths"]["/api/v1/takes/{name}/delete"].contains("post"));
  const std::string text = all.dump();
  for (std::size_t at = text.find("#/components/schemas/"); at != std::string::npos;
       at = text.find("#/components/schemas/", at + 1)) {
    const std::size_t begin = at + std::string("#/components/schemas/").size();
    const std::string name = text.substr(begin, text.find('"', begin) - begin);
    EXPECT_TRUE(all["components"]["schemas"].contains(name)) << name;
  }
  const json& take = all["components"]["schemas"]["TakeRequest"]["properties"];
  EXPECT_EQ(take["beforeS"]["type"], "number");
  EXPECT_THAT(take["action"]["enum"].get<std::vector<std::string>>(), testing::Contains("ACTION_START"));
}

}  // namespace api_test
}  // namespace mocap::web
