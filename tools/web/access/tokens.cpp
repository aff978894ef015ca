#include "web/access/tokens.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/rand.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>
#include <sstream>

#include "base/expects.h"

namespace mocap::web {
namespace {

constexpr std::size_t kDigits = 64;

bool is_hash(const std::string& text) {
  return text.size() == kDigits && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

std::optional<wire::Role> role_of(const std::string& word) {
  for (const wire::Role role : {wire::Role::Viewer, wire::Role::Operator}) {
    if (word == wire::name_of(role)) return role;
  }
  return std::nullopt;
}

bool is_word(const std::string& name) {
  return !name.empty() && name.size() <= 64 && name.find_first_of(" \t\r\n#") == std::string::npos;
}

// The token of a line; empty text: no token.
Result<std::optional<Token>> token_in(const std::string& line) {
  std::istringstream words(line.substr(0, line.find('#')));
  std::string hash, role, name, more;
  words >> hash >> role >> name >> more;
  if (hash.empty()) return std::optional<Token>();
  const auto known = role_of(role);
  if (!is_hash(hash) || !known || name.empty() || !more.empty()) {
    return Error{ErrorCode::InvalidArgument,
                 "expected SHA256 ROLE NAME, the role viewer or operator; see mocap-web token --help"};
  }
  return std::optional(Token{hash, *known, name});
}

}  // namespace

std::string sha256_of(std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  MOCAP_EXPECTS(EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_sha256(), nullptr) == 1);
  std::string hex;
  for (unsigned i = 0; i < size; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

std::string new_token() {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::array<unsigned char, 43> random{};  // 6 bit each: 258 bit
  MOCAP_EXPECTS(RAND_bytes(random.data(), static_cast<int>(random.size())) == 1);
  std::string token;
  for (const unsigned char byte : random) token += kLetters[byte % kLetters.size()];
  return token;
}

Result<std::vector<Token>> load_tokens(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) {
    return Error{ErrorCode::NotFound,
                 fmt::format("{}: cannot be read; make it with mocap-web token {} NAME", path.string(), path.string())};
  }
  std::vector<Token> tokens;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    auto token = token_in(line);
    if (!token)
      return Error{ErrorCode::InvalidArgument, fmt::format("{}:{}: {}", path.string(), number, token.error().message)};
    if (*token) tokens.push_back(**std::move(token));
  }
  return tokens;
}

Status append_token(const std::filesystem::path& path, const Token& token) {
  if (!is_word(token.name)) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("the name is '{}', expected one word of up to 64 characters", token.name)};
  }
  const int file = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
  if (file < 0) return Error{ErrorCode::Io, fmt::format("{}: {}", path.string(), std::strerror(errno))};
  const std::string line = fmt::format("{} {} {}\n", token.sha256, wire::name_of(token.role), token.name);
  const bool written = ::write(file, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  const int error = errno;
  if (::close(file) != 0 || !written)
    return Error{ErrorCode::Io, fmt::format("{}: {}", path.string(), std::strerror(error))};
  return {};
}

const Token* find_token(const std::vector<Token>& tokens, std::string_view given) {
  const std::string hash = sha256_of(given);
  const Token* found = nullptr;
  for (const Token& token : tokens) {
    if (token.sha256.size() == hash.size() && CRYPTO_memcmp(token.sha256.data(), hash.data(), hash.size()) == 0)
      found = &token;
  }
  return found;
}

}  // namespace mocap::web
