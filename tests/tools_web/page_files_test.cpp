#include "web/page_files.h"

#include <gmock/gmock.h>

namespace mocap::web {
namespace page_files_test {

HttpRequest get(const std::string& path) {
  HttpRequest request;
  request.method = "GET";
  request.path = path;
  request.accept_encoding = "gzip, br";
  return request;
}

std::string header(const HttpReply& reply, const std::string& name) {
  for (const auto& [key, value] : reply.headers) {
    if (key == name) return value;
  }
  return {};
}

TEST(PageFiles, HaveAPage) {
  const HttpReply reply = reply_with_file(page_files(), get("/"));

  EXPECT_EQ(reply.status, 200);
  EXPECT_EQ(reply.content_type, "text/html; charset=utf-8");
  EXPECT_EQ(header(reply, "Content-Encoding"), "gzip");
  EXPECT_THAT(gunzip(reply.body), testing::HasSubstr("<html"));
}

TEST(PageFiles, AreDecompressedForAClientWithoutGzip) {
  HttpRequest request = get("/index.html");
  request.accept_encoding = "";

  const HttpReply reply = reply_with_file(page_files(), request);

  EXPECT_EQ(header(reply, "Content-Encoding"), "");
  EXPECT_THAT(reply.body, testing::HasSubstr("<html"));
}

TEST(PageFiles, AreNotSentAgainToABrowserThatHasThem) {
  HttpRequest request = get("/");
  request.if_none_match = header(reply_with_file(page_files(), request), "ETag");

  const HttpReply reply = reply_with_file(page_files(), request);

  EXPECT_EQ(reply.status, 304);
  EXPECT_EQ(reply.body, "");
}

TEST(PageFiles, AreNoWayToOtherFiles) {
  for (const char* path : {"/../main.cpp", "/etc/passwd", "//index.html", "/index.html/", "", "/%2e%2e/x"}) {
    EXPECT_EQ(reply_with_file(page_files(), get(path)).status, 404) << path;
  }
}

TEST(PageFiles, DamagedDataGiveNothing) {
  EXPECT_EQ(gunzip(""), "");
  EXPECT_EQ(gunzip("no gzip"), "");
  const std::string_view whole = page_files().front().gzip;
  EXPECT_EQ(gunzip(whole.substr(0, whole.size() / 2)), "");
}

TEST(PageFiles, HaveTheirMediaTypes) {
  EXPECT_EQ(media_type_of("/app.js"), "text/javascript; charset=utf-8");
  EXPECT_EQ(media_type_of("/x"), "application/octet-stream");
}

}  // namespace page_files_test
}  // namespace mocap::web
