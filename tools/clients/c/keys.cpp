#include "keys.h"

#include <zmq.h>

#include <cstdint>
#include <filesystem>
#include <fstream>

namespace mocap::client {
namespace {

constexpr std::size_t kLength = 40;

bool is_key(const std::string& text) {
  std::uint8_t binary[32];
  return text.size() == kLength && zmq_z85_decode(binary, text.c_str()) != nullptr;
}

// Returns the key on the line that begins with `word`, or an empty string.
std::string find_in_file(const std::string& path, const std::string& word) {
  // UTF-8 also on Windows, where a plain std::string is in the code page of the system.
  std::ifstream in(std::filesystem::path(std::u8string(path.begin(), path.end())));
  for (std::string first, value; in >> first;) {
    if (first == word && in >> value) return is_key(value) ? value : std::string();
    std::getline(in, value);
  }
  return {};
}

}  // namespace

std::string read_keys(Keys& keys) {
  if (keys.server.empty() && keys.own_public.empty() && keys.own_secret.empty()) return {};
  if (keys.own_public.empty()) keys.own_public = keys.own_secret;  // own_secret is then a file with both keys
  const struct {
    std::string* key;
    const char* word;
    const char* name;
  } all[] = {{&keys.server, "public", "server_key"},
             {&keys.own_public, "public", "public_key"},
             {&keys.own_secret, "secret", "secret_key"}};
  for (const auto& [key, word, name] : all) {
    if (is_key(*key)) continue;
    const std::string found = key->empty() ? std::string() : find_in_file(*key, word);
    if (found.empty()) {
      return std::string(name) + " is neither a key (40 characters of Z85) nor a file of mocapctl keys with a line '" +
             word + " KEY'";
    }
    *key = found;
  }
  return {};
}

}  // namespace mocap::client
