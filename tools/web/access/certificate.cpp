#include "web/access/certificate.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "web/access/access.h"

namespace mocap::web {
namespace {

template <auto Free>
struct Freed {
  template <class T>
  void operator()(T* object) const {
    Free(object);
  }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Memory = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;

std::string alternative_names(const std::vector<std::string>& names) {
  std::string all = "DNS:localhost,IP:127.0.0.1,IP:::1";
  for (const std::string& name : names) all += fmt::format(",{}:{}", is_address(name) ? "IP" : "DNS", name);
  return all;
}

bool extend(X509* certificate, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str()));
  return extension != nullptr && X509_add_ext(certificate, extension.get(), -1) == 1;
}

// A certificate without its signature. nullptr: a name is malformed.
Certificate certificate_for(const std::vector<std::string>& names, int days, EVP_PKEY* key) {
  Certificate certificate(X509_new());
  X509* const raw = certificate.get();
  std::array<unsigned char, 16> serial{};
  RAND_bytes(serial.data(), static_cast<int>(serial.size()));
  serial[0] &= 0x7FU;  // positive
  BIGNUM* const number = BN_bin2bn(serial.data(), static_cast<int>(serial.size()), nullptr);
  BN_to_ASN1_INTEGER(number, X509_get_serialNumber(raw));
  BN_free(number);
  X509_set_version(raw, X509_VERSION_3);
  X509_gmtime_adj(X509_getm_notBefore(raw), -3600);  // for clocks that are a little behind
  X509_time_adj_ex(X509_getm_notAfter(raw), days, 0, nullptr);
  X509_set_pubkey(raw, key);
  X509_NAME* const subject = X509_get_subject_name(raw);
  const auto* const owner = reinterpret_cast<const unsigned char*>("mocapd");
  X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC, owner, -1, -1, 0);
  X509_set_issuer_name(raw, subject);
  const bool extended = extend(raw, NID_subject_alt_name, alternative_names(names)) &&
                        extend(raw, NID_basic_constraints, "critical,CA:FALSE") &&
                        extend(raw, NID_key_usage, "critical,digitalSignature") &&
                        extend(raw, NID_ext_key_usage, "serverAuth");
  return extended ? std::move(certificate) : nullptr;
}

std::string text_in(BIO* memory) {
  const char* data = nullptr;
  const long size = BIO_get_mem_data(memory, &data);
  return {data, static_cast<std::size_t>(size)};
}

Status write_new(const std::string& path, const std::string& text, ::mode_t mode) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) {
    const bool exists = errno == EEXIST;
    return Error{
        exists ? ErrorCode::Busy : ErrorCode::Io,
        fmt::format("{}: {}{}", path, std::strerror(errno), exists ? "; remove it, or choose another prefix" : "")};
  }
  const bool written = ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (::close(file) != 0 || !written) return Error{ErrorCode::Io, fmt::format("{}: {}", path, std::strerror(errno))};
  return {};
}

std::string fingerprint_of(const X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  X509_digest(certificate, EVP_sha256(), digest.data(), &size);
  return fmt::format("{:02X}", fmt::join(digest.begin(), digest.begin() + size, ":"));
}

}  // namespace

Result<NewCertificate> make_certificate(const std::string& prefix, const std::vector<std::string>& names, int days) {
  const bool odd = std::ranges::any_of(
      names, [](const std::string& name) { return name.empty() || name.find_first_of(", \n") != std::string::npos; });
  const Key key(EVP_EC_gen("P-256"));
  const Certificate certificate = odd || key == nullptr ? nullptr : certificate_for(names, days, key.get());
  if (certificate == nullptr || X509_sign(certificate.get(), key.get(), EVP_sha256()) == 0) {
    return Error{ErrorCode::InvalidArgument, "a name is malformed: expected host names and addresses"};
  }
  const Memory certificate_text(BIO_new(BIO_s_mem()));
  const Memory key_text(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(certificate_text.get(), certificate.get());
  PEM_write_bio_PKCS8PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  NewCertificate made{prefix + ".crt", prefix + ".key", fingerprint_of(certificate.get())};
  if (Status written = write_new(made.private_key, text_in(key_text.get()), 0600); !written) return written.error();
  if (Status written = write_new(made.certificate, text_in(certificate_text.get()), 0644); !written)
    return written.error();
  return made;
}

std::vector<std::string> names_of_this_machine() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0 || name[0] == '\0') return {};
  std::string host = host_name_in(name.data());
  const bool is_local = host.ends_with(".local");
  return is_local ? std::vector{host} : std::vector{host, host + ".local"};
}

}  // namespace mocap::web
