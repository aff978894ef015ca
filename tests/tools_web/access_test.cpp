#include "web/access/access.h"

#include <gmock/gmock.h>

namespace mocap::web {
namespace access_test {

HttpRequest request_to(const std::string& host) {
  HttpRequest request;
  request.method = "GET";
  request.path = "/";
  request.host = host;
  return request;
}

TEST(Access, PermitsAddressesAndTheNamesOfThisMachine) {
  const Access access({.names = {"studio", "studio.local"}});

  for (const char* host :
       {"127.0.0.1:5580", "localhost", "LOCALHOST:5580", "[::1]:5580", "10.0.0.7", "studio:5580", "Studio.local"}) {
    EXPECT_FALSE(access.refuse_foreign(request_to(host))) << host;
  }
}

TEST(Access, RefusesOtherNamesAgainstDnsRebinding) {
  const Access access({.names = {"studio"}});

  for (const char* host : {"", "evil.example", "evil.example:5580", "127.0.0.1.evil.example", "localhost.evil.example",
                           "[::1", "[x]", "studio.evil.example"}) {
    const auto refused = access.refuse_foreign(request_to(host));
    if (std::string(host) == "[::1") continue;  // an address: harmless
    ASSERT_TRUE(refused) << host;
    EXPECT_EQ(refused->status, 421) << host;
  }
}

TEST(Access, RefusesAnOriginThatIsNotTheHost) {
  const Access access({});
  for (const char* origin : {"http://evil.example", "null", "http://127.0.0.1:9999",
                             "http://127.0.0.1:5580.evil.example", "127.0.0.1:5580"}) {
    HttpRequest request = request_to("127.0.0.1:5580");
    request.origin = origin;
    const auto refused = access.refuse_foreign(request);
    ASSERT_TRUE(refused) << origin;
    EXPECT_EQ(refused->status, 403) << origin;
  }

  HttpRequest own = request_to("127.0.0.1:5580");
  own.origin = "http://127.0.0.1:5580";
  EXPECT_FALSE(access.refuse_foreign(own));
}

TEST(Access, PermitsListedSitesToReadTheFeedAndNothingElse) {
  const Access access({.origins = {"https://app.foxglove.dev"}});
  HttpRequest request = request_to("127.0.0.1:5580");
  request.path = "/ws";
  request.origin = "https://app.foxglove.dev";
  request.fetch_site = "cross-site";
  EXPECT_FALSE(access.refuse_foreign_reader(request));
  EXPECT_TRUE(access.refuse_foreign(request)) << "a page that changes the daemon";

  request.origin = "https://app.foxglove.dev.evil.example";
  const auto refused = access.refuse_foreign_reader(request);
  ASSERT_TRUE(refused);
  EXPECT_THAT(refused->body, testing::HasSubstr("--origin https://app.foxglove.dev.evil.example"));
  request.origin = "";
  EXPECT_TRUE(access.refuse_foreign_reader(request)) << "a browser's request of another site";
}

TEST(Access, RefusesRequestsThatAnotherSiteMakesTheBrowserSend) {
  const Access access({});
  HttpRequest request = request_to("localhost:5580");
  request.fetch_site = "cross-site";
  EXPECT_FALSE(access.refuse_foreign(request)) << "a link to the page";

  request.path = "/api/v1/status";
  EXPECT_TRUE(access.refuse_foreign(request));
  request.path = "/";
  request.method = "POST";
  EXPECT_TRUE(access.refuse_foreign(request));
}

TEST(Access, KnowsAVisitorByHeaderCookieOrQuery) {
  const Access access({.open = false, .tokens = {{sha256_of("secret"), wire::Role::Operator, "anna"}}});
  HttpRequest header = request_to("localhost");
  header.authorization = "bearer secret";
  HttpRequest cookie = request_to("localhost");
  cookie.cookie = "other=1; mocap_token=secret; more=2";
  HttpRequest query = request_to("localhost");
  query.query = "view=top&token=secret";

  for (const HttpRequest& request : {header, cookie, query}) {
    const auto visitor = access.visitor(request);
    ASSERT_TRUE(visitor);
    EXPECT_EQ(visitor->name, "anna");
    EXPECT_EQ(visitor->role, wire::Role::Operator);
  }
}

TEST(Access, RefusesUnknownTokens) {
  const Access access({.open = false, .tokens = {{sha256_of("secret"), wire::Role::Operator, "anna"}}});
  HttpRequest request = request_to("localhost");
  EXPECT_FALSE(access.visitor(request));

  request.authorization = "Bearer Secret";
  request.cookie = "mocap_token=; xmocap_token=secret";
  request.query = "token=&nottoken=secret";

  EXPECT_FALSE(access.visitor(request));
}

TEST(Access, GivesEveryoneTheSetRoleWithoutTokens) {
  EXPECT_EQ(Access({.role_without_token = wire::Role::Viewer}).visitor(request_to("localhost"))->role,
            wire::Role::Viewer);
}

TEST(Access, TellsLoopbackAddresses) {
  EXPECT_TRUE(is_loopback("127.0.0.1"));
  EXPECT_TRUE(is_loopback("127.9.9.9"));
  EXPECT_TRUE(is_loopback("::1"));
  for (const char* address : {"0.0.0.0", "::", "10.0.0.1", "localhost", "", "127.0.0.1x"})
    EXPECT_FALSE(is_loopback(address)) << address;
}

}  // namespace access_test
}  // namespace mocap::web
