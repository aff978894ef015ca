#include "web/access/certificate.h"

#include <gmock/gmock.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <cstdio>

#include "support/temporary_folder.h"

namespace mocap::web {
namespace certificate_test {

X509* read(const std::filesystem::path& path) {
  std::FILE* file = std::fopen(path.c_str(), "r");
  X509* certificate = file == nullptr ? nullptr : PEM_read_X509(file, nullptr, nullptr, nullptr);
  if (file != nullptr) std::fclose(file);
  return certificate;
}

TEST(Certificate, IsForTheNamesOfThisMachineAndForTheGivenOnes) {
  const support::TemporaryFolder folder;

  const auto made = make_certificate(folder.path() / "web", {"studio.local", "10.0.0.7"}, 30);

  ASSERT_TRUE(made) << made.error().message;
  X509* const certificate = read(made->certificate);
  ASSERT_NE(certificate, nullptr);
  for (const char* name : {"localhost", "studio.local"})
    EXPECT_EQ(X509_check_host(certificate, name, 0, 0, nullptr), 1) << name;
  for (const char* address : {"127.0.0.1", "::1", "10.0.0.7"})
    EXPECT_EQ(X509_check_ip_asc(certificate, address, 0), 1) << address;
  EXPECT_EQ(X509_check_host(certificate, "evil.example", 0, 0, nullptr), 0);
  EXPECT_EQ(X509_verify(certificate, X509_get0_pubkey(certificate)), 1);
  EXPECT_EQ(X509_cmp_current_time(X509_get0_notBefore(certificate)), -1);
  EXPECT_EQ(X509_cmp_current_time(X509_get0_notAfter(certificate)), 1);
  EXPECT_EQ(made->sha256.size(), 32U * 3 - 1);
  X509_free(certificate);
}

TEST(Certificate, HasAKeyThatOthersCannotRead) {
  const support::TemporaryFolder folder;
  const auto made = make_certificate(folder.path() / "web", {}, 30);

  struct stat about {};
  ASSERT_EQ(::stat(made->private_key.c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777U, 0600U);
}

TEST(Certificate, ReplacesNoFile) {
  const support::TemporaryFolder folder;
  ASSERT_TRUE(make_certificate(folder.path() / "web", {}, 30));

  const auto again = make_certificate(folder.path() / "web", {}, 30);

  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::Busy);
}

TEST(Certificate, RefusesAMalformedName) {
  const support::TemporaryFolder folder;

  EXPECT_EQ(make_certificate(folder.path() / "web", {"a,DNS:evil.example"}, 30).error().code,
            ErrorCode::InvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "web.key"));
}

}  // namespace certificate_test
}  // namespace mocap::web
