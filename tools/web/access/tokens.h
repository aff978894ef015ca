#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "wire/role.h"

namespace mocap::web {

/// A token by which a client beyond this machine proves its role. The file has its SHA-256 alone, so that a reader of
/// the file cannot use the token.
struct Token {
  std::string sha256;  ///< 64 hexadecimal digits
  wire::Role role = wire::Role::Viewer;
  std::string name;  ///< owner, for the log; one word
};

/// The SHA-256 of `text` as 64 hexadecimal digits.
std::string sha256_of(std::string_view text);

/// A random token of 256 bit, as 43 characters that need no escape in a URL.
std::string new_token();

/// Reads a file with one line "SHA256 ROLE NAME" for each token; text after # is a comment. Fails with NotFound if the
/// file cannot be read, and with InvalidArgument, file and line if a line is malformed.
Result<std::vector<Token>> load_tokens(const std::filesystem::path& path);

/// Appends a token to the file, which is created with mode 600 if it does not exist. Fails with Io and InvalidArgument.
Status append_token(const std::filesystem::path& path, const Token& token);

/// Compares in constant time. nullptr: unknown.
const Token* find_token(const std::vector<Token>& tokens, std::string_view given);

}  // namespace mocap::web
