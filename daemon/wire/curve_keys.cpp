#include "wire/curve_keys.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "base/read_file.h"

namespace mocap::wire {
namespace {

constexpr std::size_t kKeyLength = 40;
constexpr std::uintmax_t kMostBytes = 1 << 20;  // about 20000 clients; a larger file is not a list of keys

Error bad_key_file(const std::filesystem::path& path, std::string_view what) {
  return {ErrorCode::InvalidArgument, fmt::format("{}: {}", path.string(), what)};
}

Result<std::string> read(const std::filesystem::path& path) {
  Result<std::string> text = read_file(path, kMostBytes);
  if (text) return text;
  if (text.error().code == ErrorCode::InvalidArgument) {
    return bad_key_file(path, "is larger than 1 MiB, expected a file of mocapctl keys");
  }
  if (path.string().starts_with("$CREDENTIALS_DIRECTORY")) {
    return Error{ErrorCode::NotFound,
                 fmt::format("{}: the service manager provides no credentials; add LoadCredential= "
                             "to the unit, or name a file",
                             path.string())};
  }
  return Error{ErrorCode::NotFound, fmt::format("{}: cannot be read; mocapctl keys makes such files", path.string())};
}

// Removes a comment: '#' at the start of the line or after a blank. Z85 uses '#' too, but no key starts with '#': five
// Z85 characters that start with '#' (value 84) encode more than 32 bits.
std::string without_comment(const std::string& line) {
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '#' && (i == 0 || line[i - 1] == ' ' || line[i - 1] == '\t')) return line.substr(0, i);
  }
  return line;
}

// Creates `path` with `mode`, writes `text` and closes the file. Fails with Busy if `path` exists.
Status write_new(const std::filesystem::path& path, const std::string& text, mode_t mode) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  if (file < 0) {
    const bool exists = errno == EEXIST;
    return Error{exists ? ErrorCode::Busy : ErrorCode::Io,
                 fmt::format("{}: {}", path.string(),
                             exists ? "exists already; choose another name or remove the file" : std::strerror(errno))};
  }
  const ssize_t written = ::write(file, text.data(), text.size());
  const bool whole = written == static_cast<ssize_t>(text.size()) && ::fsync(file) == 0;
  if (::close(file) == 0 && whole) return {};
  ::unlink(path.c_str());
  return Error{ErrorCode::Io, fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno))};
}

}  // namespace

// systemd guards its credentials with an access list, of which the bits of the group are the mask.
Status check_private(const std::filesystem::path& path) {
  struct ::stat status {};
  if (::stat(path.c_str(), &status) != 0) return bad_key_file(path, std::strerror(errno));
  const char* credentials = std::getenv("CREDENTIALS_DIRECTORY");
  const bool is_credential = credentials != nullptr && path.parent_path() == std::filesystem::path(credentials);
  const mode_t others = is_credential ? S_IRWXO : S_IRWXG | S_IRWXO;
  if ((status.st_mode & others) == 0) return {};
  return bad_key_file(path,
                      fmt::format("has a secret key and mode {:04o}, so that its group or others have access; expected "
                                  "0600: chmod 600 '{}'; consider a new key",
                                  status.st_mode & 07777, path.string()));
}

namespace {

Result<KeyPair> parse_key_pair(const std::filesystem::path& path) {
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
  if (!is_key(pair.public_key))
    return bad_key_file(path, "has no line 'public KEY', expected a file of mocapctl keys new");
  if (!pair.secret_key.empty() && !is_key(pair.secret_key))
    return bad_key_file(path, "the line 'secret KEY' has no valid key");
  return pair;
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
  Result<KeyPair> pair = parse_key_pair(path);
  if (!pair || pair->secret_key.empty()) return pair;
  if (const Status is_private = check_private(path); !is_private) return is_private.error();
  return pair;
}

Result<std::string> load_public_key(const std::filesystem::path& path) {
  Result<KeyPair> pair = parse_key_pair(path);
  if (!pair) return pair.error();
  return std::move(pair->public_key);
}

Result<ClientKeys> load_client_keys(const std::string& server_key, const std::string& secret_key) {
  if (server_key.empty() != secret_key.empty()) {
    return Error{ErrorCode::InvalidArgument,
                 "--server-key (the daemon's public key) and --secret-key (the file of your own key pair) go together"};
  }
  ClientKeys keys;
  if (server_key.empty()) return keys;
  keys.server_key = server_key;
  if (!is_key(server_key)) {
    Result<std::string> read = load_public_key(server_key);
    if (!read) return read.error();
    keys.server_key = *std::move(read);
  }
  Result<KeyPair> own = load_key_pair(secret_key);
  if (!own) return own.error();
  if (own->secret_key.empty())
    return bad_key_file(secret_key, "has no line 'secret KEY', expected the file of your own key");
  keys.own_key = *std::move(own);
  return keys;
}

Status set_keys(ZmqSocket& socket, const ClientKeys& keys) {
  if (!keys.on()) return {};
  const std::pair<int, const std::string*> options[] = {{ZMQ_CURVE_SERVERKEY, &keys.server_key},
                                                        {ZMQ_CURVE_PUBLICKEY, &keys.own_key.public_key},
                                                        {ZMQ_CURVE_SECRETKEY, &keys.own_key.secret_key}};
  for (const auto& [option, key] : options) {
    if (Status set = socket.set(option, std::string_view(*key)); !set) return set;
  }
  return {};
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
    if (!is_key(key))
      return bad_key_file(path, fmt::format("line {}: '{}' is not a key, expected 40 characters", number, key));
    if (role != "viewer" && role != "operator") {
      return bad_key_file(path, fmt::format("line {}: role is '{}', expected viewer or operator", number, role));
    }
    keys.push_back({key, role == "operator" ? Role::Operator : Role::Viewer, name});
  }
  return keys;
}

Status save_allowed_keys(const std::filesystem::path& path, const std::vector<AllowedKey>& keys) {
  std::string text =
      "# Clients that may connect to mocapd: KEY ROLE NAME. mocapctl keys changes this list; mocapd reloads it "
      "itself.\n";
  for (const AllowedKey& key : keys) {
    text += fmt::format("{} {} {}\n", key.public_key, name_of(key.role), key.name);
  }
  const std::filesystem::path beside = path.string() + fmt::format(".{}.new", ::getpid());
  // Public keys only, and the daemon reads the list as a user of its own.
  if (Status written = write_new(beside, text, S_IRUSR | S_IWUSR | S_IRGRP | S_IROTH); !written) return written;
  struct ::stat old {};
  if (::stat(path.c_str(), &old) == 0) static_cast<void>(::chmod(beside.c_str(), old.st_mode & 07777));
  if (::rename(beside.c_str(), path.c_str()) == 0) return {};
  const Error failed{ErrorCode::Io, fmt::format("{}: cannot be replaced: {}", path.string(), std::strerror(errno))};
  ::unlink(beside.c_str());
  return failed;
}

}  // namespace mocap::wire
