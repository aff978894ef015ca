#include "wire/curve_keys.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

namespace mocap::wire {
namespace {

constexpr std::size_t kKeyLength = 40;
constexpr std::uintmax_t kMostBytes = 1 << 20;  // no list of ours is larger

Error wrong(const std::filesystem::path& path, std::string_view what) {
  return {ErrorCode::InvalidArgument, fmt::format("{}: {}", path.string(), what)};
}

Result<std::string> read(const std::filesystem::path& path) {
  std::error_code fault;
  const std::uintmax_t size = std::filesystem::file_size(path, fault);
  std::ifstream in(path);
  if (fault || !in) {
    return Error{ErrorCode::NotFound, fmt::format("{}: cannot be read; mocapctl keys makes such files", path.string())};
  }
  if (size > kMostBytes) return wrong(path, "is larger than 1 MiB, expected a file of mocapctl keys");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

// A # is one of Z85's characters, but no key begins with one: five characters that do are more than 32 bits.
std::string without_comment(const std::string& line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) return line.substr(0, i);
  }
  return line;
}

// Opens a file that did not exist, for its owner alone, writes it and closes it.
Status write_new(const std::filesystem::path& path, const std::string& text, mode_t mode) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) {
    const bool exists = errno == EEXIST;
    return Error{exists ? ErrorCode::Busy : ErrorCode::Io,
                 fmt::format("{}: {}", path.string(),
                             exists ? "is there already; take another name or remove it" : std::strerror(errno))};
  }
  const ssize_t written = ::write(file, text.data(), text.size());
  const bool whole = written == static_cast<ssize_t>(text.size()) && ::fsync(file) == 0;
  if (::close(file) == 0 && whole) return {};
  ::unlink(path.c_str());
  return Error{ErrorCode::Io, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno))};
}

}  // namespace

bool is_key(std::string_view text) {
  if (text.size() != kKeyLength) return false;
  std::array<std::uint8_t, 32> bytes{};
  return zmq_z85_decode(bytes.data(), std::string(text).c_str()) != nullptr;
}

Result<KeyPair> new_key_pair() {
  std::array<char, kKeyLength + 1> public_key{};
  std::array<char, kKeyLength + 1> secret_key{};
  if (zmq_curve_keypair(public_key.data(), secret_key.data()) != 0) {
    return Error{ErrorCode::Unsupported, "ZeroMQ was built without CURVE; Debian's libzmq5 has it"};
  }
  return KeyPair{public_key.data(), secret_key.data()};
}

Status save_key_pair(const std::filesystem::path& path, const KeyPair& pair) {
  return write_new(path,
                   fmt::format("# A key of mocapd. The public line may be given away, the secret one never.\n"
                               "public {}\nsecret {}\n",
                               pair.public_key, pair.secret_key),
                   S_IRUSR | S_IWUSR);
}

Result<KeyPair> load_key_pair(const std::filesystem::path& path) {
  const Result<std::string> text = read(path);
  if (!text) return text.error();
  KeyPair pair;
  std::istringstream lines(*text);
  for (std::string word, value; lines >> word;) {
    if (word == "public" && lines >> value) {
      pair.public_key = value;
    } else if (word == "secret" && lines >> value) {
      pair.secret_key = value;
    } else {
      std::getline(lines, value);
    }
  }
  if (!is_key(pair.public_key)) return wrong(path, "has no line 'public KEY', expected a file of mocapctl keys new");
  if (!pair.secret_key.empty() && !is_key(pair.secret_key)) return wrong(path, "its secret is no key");
  return pair;
}

Result<std::string> load_public_key(const std::filesystem::path& path) {
  Result<KeyPair> pair = load_key_pair(path);
  if (!pair) return pair.error();
  return std::move(pair->public_key);
}

Result<std::vector<AllowedKey>> load_allowed_keys(const std::filesystem::path& path) {
  const Result<std::string> text = read(path);
  if (!text) return text.error();
  std::vector<AllowedKey> keys;
  std::istringstream lines(*text);
  std::string line;
  for (std::size_t number = 1; std::getline(lines, line); ++number) {
    std::istringstream words(without_comment(line));
    std::string key, role, name;
    if (!(words >> key)) continue;
    words >> role >> name;
    if (!is_key(key)) return wrong(path, fmt::format("line {}: '{}' is no key, expected 40 characters", number, key));
    if (role != "viewer" && role != "operator") {
      return wrong(path, fmt::format("line {}: role is '{}', expected viewer or operator", number, role));
    }
    keys.push_back({key, role == "operator" ? Role::Operator : Role::Viewer, name});
  }
  return keys;
}

Status save_allowed_keys(const std::filesystem::path& path, const std::vector<AllowedKey>& keys) {
  std::string text =
      "# Who may connect to mocapd: KEY ROLE NAME. mocapctl keys changes this list; mocapd sees it at once.\n";
  for (const AllowedKey& key : keys) {
    text += fmt::format("{} {} {}\n", key.public_key, name_of(key.role), key.name);
  }
  const std::filesystem::path beside = path.string() + fmt::format(".{}.new", ::getpid());
  if (Status written = write_new(beside, text, S_IRUSR | S_IWUSR | S_IRGRP); !written) return written;
  if (::rename(beside.c_str(), path.c_str()) == 0) return {};
  const Error failed{ErrorCode::Io, fmt::format("{}: cannot be replaced: {}", path.string(), std::strerror(errno))};
  ::unlink(beside.c_str());
  return failed;
}

}  // namespace mocap::wire
