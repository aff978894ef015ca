#include "web/takes/take_site.h"

#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::web {
namespace take_site_test {

using nlohmann::json;

constexpr auto kLong = std::chrono::seconds(60);  // time limit of a failing test
constexpr const char* kLocal = "tcp://127.0.0.1:5570";

HttpReply ask(TakeSite& site, const std::string& path, const std::string& query = "", const std::string& body = "") {
  HttpRequest request;
  request.method = body.empty() ? "GET" : "POST";
  request.path = path;
  request.query = query;
  request.body = body;
  std::promise<HttpReply> came;
  site.answer(request, [&](HttpReply reply) { came.set_value(std::move(reply)); });
  auto reply = came.get_future();
  EXPECT_EQ(reply.wait_for(kLong), std::future_status::ready);
  return reply.get();
}

const TakeSite::RunHere kAtOnce = [](const std::function<void()>& work) { work(); };

TEST(TakeSite, AnswersAboutTheTakesOfAFolder) {
  const support::TemporaryFolder folder;
  take::record_example(folder.path() / "walk 3.mcap", 24);
  TakeSite site(folder.path(), kLocal, kAtOnce);

  EXPECT_EQ(json::parse(ask(site, "/api/v1/takes").body)["takes"][0]["name"], "walk 3");
  EXPECT_EQ(json::parse(ask(site, "/api/v1/takes/walk%203").body)["slate"], "12A");
  EXPECT_EQ(json::parse(ask(site, "/api/v1/takes/walk%203/verify").body)["valid"], true);
  EXPECT_EQ(ask(site, "/api/v1/takes/walk%203/edit", "", R"({"rating":5})").status, 200);
  EXPECT_GT(ask(site, "/api/v1/takes/walk%203/snapshots", "from_s=0&seconds=0.1").body.size(), 100U);
  const HttpReply file = ask(site, "/takes/walk%203.mcap");
  ASSERT_EQ(file.status, 200);
  EXPECT_EQ(file.stream->size(), std::filesystem::file_size(folder.path() / "walk 3.mcap"));
}

TEST(TakeSite, RefusesWhatIsNotThere) {
  const support::TemporaryFolder folder;
  take::record_example(folder.path() / "walk.mcap", 3);
  TakeSite site(folder.path() / "", kLocal, kAtOnce);

  EXPECT_EQ(ask(site, "/api/v1/takes/run").status, 404);
  EXPECT_EQ(ask(site, "/api/v1/takes/walk/jump").status, 404);
  EXPECT_EQ(ask(site, "/api/v1/takes/..%2fwalk").status, 400);
  EXPECT_EQ(ask(site, "/api/v1/takes/%zz").status, 400);
  EXPECT_EQ(ask(site, "/api/v1/takes/walk/snapshots", "from_s=-1").status, 400);
  EXPECT_EQ(ask(site, "/api/v1/takes/walk/snapshots", "seconds=1000").status, 400);
  EXPECT_EQ(ask(site, "/api/v1/takes/walk/snapshots", "seconds=nan").status, 400);
  EXPECT_EQ(ask(site, "/api/v1/takes/walk/export").status, 400);
  EXPECT_EQ(ask(site, "/takes/..%2Fwalk.mcap").status, 400);
  EXPECT_EQ(ask(site, "/takes/walk").status, 404);
  EXPECT_EQ(ask(site, "/takes/run.c3d").status, 404);
}

TEST(TakeSite, TakesTheFolderOfTheTakeThatALocalDaemonReports) {
  const support::TemporaryFolder folder;
  folder.write("walk.mcap", "");
  for (const char* feed : {kLocal, "tcp://localhost:5570", "ipc:///run/mocapd/feed"}) {
    TakeSite site({}, feed, kAtOnce);

    site.note_take((folder.path() / "walk.mcap").string());

    EXPECT_EQ(ask(site, "/api/v1/takes").status, 200) << feed;
    EXPECT_EQ(site.folder(), folder.path()) << feed;
  }
}

TEST(TakeSite, ATakeHereIsNotThatOfARemoteDaemon) {
  const support::TemporaryFolder folder;
  folder.write("walk.mcap", "");
  TakeSite site({}, "tcp://10.0.0.7:5570", kAtOnce);

  site.note_take((folder.path() / "walk.mcap").string());

  EXPECT_EQ(site.folder(), "");
  const HttpReply reply = ask(site, "/api/v1/takes/walk/delete", "", "{}");
  EXPECT_EQ(reply.status, 404);
  EXPECT_THAT(reply.body, testing::HasSubstr("tcp://10.0.0.7:5570"));
  EXPECT_THAT(reply.body, testing::HasSubstr("--takes FOLDER"));
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "walk.mcap"));
}

TEST(TakeSite, SaysWhyTheFolderIsUnknown) {
  const support::TemporaryFolder folder;
  folder.write("file", "");
  TakeSite site({}, kLocal, kAtOnce);
  site.note_take("");
  EXPECT_THAT(ask(site, "/api/v1/takes").body, testing::HasSubstr("or record a take"));

  for (const auto& [path, reason] : {std::pair<std::string, std::string>{"relative/walk.mcap", "relative"},
                                     {folder.path() / "walk.mcap", "No such file"},
                                     {folder.path() / "file" / "walk.mcap", "Not a directory"},
                                     {folder.path(), "not a regular file"}}) {
    site.note_take(path);

    const std::string said = ask(site, "/api/v1/takes").body;
    EXPECT_EQ(site.folder(), "") << path;
    EXPECT_THAT(said, testing::HasSubstr("'" + path + "' is not readable here: "));
    EXPECT_THAT(said, testing::HasSubstr(reason)) << path;
    EXPECT_THAT(said, testing::Not(testing::HasSubstr("record a take"))) << path;
  }
}

TEST(TakeSite, KnowsWhatChangesATake) {
  HttpRequest request;
  for (const char* path : {"/api/v1/takes/walk/edit", "/api/v1/takes/walk/rename", "/api/v1/takes/walk/delete"}) {
    request.path = path;
    EXPECT_TRUE(is_change_of_take(request)) << path;
    EXPECT_TRUE(TakeSite::is_about_takes(path));
  }
  for (const char* path : {"/api/v1/takes", "/api/v1/takes/walk", "/takes/walk.mcap", "/api/v1/takes/walk/export",
                           "/api/v1/takes/edit", "/api/v1/takes/rename", "/api/v1/takes/delete"}) {
    request.path = path;
    EXPECT_FALSE(is_change_of_take(request)) << path;
    EXPECT_TRUE(TakeSite::is_about_takes(path));
  }
  EXPECT_FALSE(TakeSite::is_about_takes("/api/v1/take"));
}

}  // namespace take_site_test
}  // namespace mocap::web
