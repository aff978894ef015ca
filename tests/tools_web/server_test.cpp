#include "web/http/server.h"

#include <gmock/gmock.h>

#include <fstream>

#include "support/temporary_folder.h"
#include "web/access/certificate.h"

namespace mocap::web {
namespace server_test {

using testing::HasSubstr;

ServerSettings any_port() {
  ServerSettings settings;
  settings.port = 0;
  return settings;
}

TEST(Server, RefusesToServeOtherMachinesWithoutTlsAndTokens) {
  ServerSettings settings = any_port();
  settings.listen = "0.0.0.0";
  EXPECT_THAT(Server::open(settings).error().message, HasSubstr("mocap-web cert"));

  settings.certificate = "web.crt";
  EXPECT_THAT(check_exposure(settings).error().message, HasSubstr("mocap-web token"));

  settings.access.open = false;
  EXPECT_TRUE(check_exposure(settings));
}

TEST(Server, NamesTheAddressOfThePage) {
  const auto server = Server::open(any_port());

  ASSERT_TRUE(server) << server.error().message;
  EXPECT_THAT((*server)->address(), testing::MatchesRegex("http://127\\.0\\.0\\.1:[0-9]+"));
}

TEST(Server, SaysThatAnotherProgramHasThePort) {
  const auto first = Server::open(any_port());
  ServerSettings settings = any_port();
  const std::string address = (*first)->address();
  settings.port = static_cast<std::uint16_t>(std::stoi(address.substr(address.rfind(':') + 1)));

  const auto second = Server::open(settings);

  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::Busy);
}

TEST(Server, NamesAFaultyCertificateAndAddress) {
  const support::TemporaryFolder folder;
  ServerSettings settings = any_port();
  settings.certificate = folder.write("web.crt", "no certificate");
  settings.private_key = settings.certificate;
  EXPECT_THAT(Server::open(settings).error().message, HasSubstr("--certificate"));

  const auto made = make_certificate(folder.path() / "good", {}, 30);
  settings.certificate = made->certificate;
  EXPECT_THAT(Server::open(settings).error().message, HasSubstr("--private-key"));
  settings.private_key = made->private_key;
  EXPECT_THAT((*Server::open(settings))->address(), HasSubstr("https://"));

  settings.listen = "here";
  settings.access.open = false;
  EXPECT_THAT(Server::open(settings).error().message, HasSubstr("--listen"));
}

}  // namespace server_test
}  // namespace mocap::web
