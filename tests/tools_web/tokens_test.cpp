#include "web/access/tokens.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "support/temporary_folder.h"

namespace mocap::web {
namespace tokens_test {

TEST(Tokens, HashAsPublished) {
  // FIPS 180-4, the example "abc".
  EXPECT_EQ(sha256_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Tokens, AreRandomAndNeedNoEscapeInAUrl) {
  const std::string token = new_token();

  EXPECT_EQ(token.size(), 43U);
  EXPECT_EQ(token.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"),
            std::string::npos);
  EXPECT_NE(token, new_token());
}

TEST(Tokens, AreAppendedToAFileThatOthersCannotRead) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "web.tokens";

  ASSERT_TRUE(append_token(path, {sha256_of("a"), wire::Role::Viewer, "screen"}));
  ASSERT_TRUE(append_token(path, {sha256_of("b"), wire::Role::Operator, "anna"}));

  const auto tokens = load_tokens(path);
  ASSERT_TRUE(tokens) << tokens.error().message;
  ASSERT_EQ(tokens->size(), 2U);
  EXPECT_EQ(find_token(*tokens, "b")->name, "anna");
  EXPECT_EQ(find_token(*tokens, "c"), nullptr);
  struct stat about {};
  ASSERT_EQ(::stat(path.c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0600U);
}

TEST(Tokens, FaultsNameFileAndLine) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "web.tokens";
  std::ofstream(path) << "# a comment\n\n" << sha256_of("a") << " boss anna\n";

  const auto tokens = load_tokens(path);

  ASSERT_FALSE(tokens);
  EXPECT_THAT(tokens.error().message, testing::HasSubstr("web.tokens:3:"));
  EXPECT_EQ(load_tokens(folder.path() / "none").error().code, ErrorCode::NotFound);
}

TEST(Tokens, RefuseANameThatWouldBreakTheLine) {
  const support::TemporaryFolder folder;

  EXPECT_FALSE(append_token(folder.path() / "web.tokens", {sha256_of("a"), wire::Role::Viewer, "two words"}));
}

}  // namespace tokens_test
}  // namespace mocap::web
