#include "wire/gatekeeper.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <zmq.h>

#include <array>
#include <utility>

#include "base/log.h"

namespace mocap::wire {
namespace {

constexpr const char* kAddress = "inproc://zeromq.zap.01";
constexpr std::size_t kMaxLoggedRefusals = 256;  // bound of logged_at_
constexpr Duration kRepeatRefusalAfter = std::chrono::minutes(1);
constexpr std::size_t kParts = 7;  // version, request id, domain, address, identity, mechanism, public key (RFC 27)

}  // namespace

Gatekeeper::Gatekeeper(std::filesystem::path allowed_file, std::string who, AuditTrail* audit)
    : file_(std::move(allowed_file)), who_(std::move(who)), audit_(audit) {}

Result<std::unique_ptr<Gatekeeper>> Gatekeeper::open(const ZmqContext& context, const CurveSettings& settings,
                                                     std::string who, AuditTrail* audit) {
  std::unique_ptr<Gatekeeper> made(new Gatekeeper(settings.allowed, std::move(who), audit));
  Result<KeyPair> server = load_key_pair(settings.server_key);
  if (!server) return server.error();
  if (server->secret_key.empty()) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{}: has no line 'secret KEY', expected the server's own key",
                                                         settings.server_key.string())};
  }
  made->server_ = *std::move(server);
  if (Status read = made->read_list(); !read) return read.error();
  if (Status opened = made->socket_.open(context, ZMQ_REP, "authentication"); !opened) return opened.error();
  if (Status set = made->socket_.set(ZMQ_LINGER, 0); !set) return set.error();
  if (zmq_bind(made->socket_.get(), kAddress) != 0) return zmq_failure("authentication");
  return made;
}

Status Gatekeeper::guard(ZmqSocket& socket, std::string_view domain) const {
  if (Status set = socket.set(ZMQ_ZAP_DOMAIN, domain); !set) return set;
  if (Status set = socket.set(ZMQ_CURVE_SERVER, 1); !set) return set;
  return socket.set(ZMQ_CURVE_SECRETKEY, server_.secret_key);
}

Gatekeeper::FileState Gatekeeper::state_of(const std::filesystem::path& path) {
  std::error_code ignored;
  FileState state;
  state.written = std::filesystem::last_write_time(path, ignored);
  state.size = std::filesystem::file_size(path, ignored);
  struct ::stat status {};
  if (::stat(path.c_str(), &status) == 0) state.inode = status.st_ino;
  return state;
}

Status Gatekeeper::read_list() {
  const FileState state = state_of(file_);
  const Result<std::vector<AllowedKey>> keys = load_allowed_keys(file_);
  if (!keys) return keys.error();
  read_state_ = state;
  allowed_.clear();
  for (const AllowedKey& key : *keys) allowed_[key.public_key] = key;
  return {};
}

void Gatekeeper::serve(int at_most, Timestamp now) {
  while (at_most-- > 0) {
    zmq_pollitem_t item{socket_.get(), 0, ZMQ_POLLIN, 0};
    if (zmq_poll(&item, 1, 0) <= 0) return;
    authenticate(now);
  }
}

void Gatekeeper::authenticate(Timestamp now) {
  std::array<std::string, kParts> parts;
  std::size_t count = 0;
  ZmqMessage part;
  do {
    if (!part.receive(socket_)) return;
    if (count < kParts) parts[count] = part.bytes();
    ++count;
  } while (part.has_more());
  request_id_ = parts[1];
  if (count != kParts || parts[0] != "1.0" || parts[5] != "CURVE" || parts[6].size() != 32) {
    ++refused_;
    return answer("400", "expected CURVE", "");
  }
  std::array<char, 41> text{};
  zmq_z85_encode(text.data(), reinterpret_cast<const std::uint8_t*>(parts[6].data()), parts[6].size());
  // Reload first, so that a key removed just now is rejected.
  refresh();
  const std::string key(text.data());
  if (allowed_.count(key) != 0) return answer("200", "OK", key);
  ++refused_;
  log_refused(key, parts[3], now);
  answer("400", "key is not allowed", "");
}

void Gatekeeper::answer(std::string_view status, std::string_view text, std::string_view user) {
  const auto send = [&](std::string_view part, int more) {
    zmq_send(socket_.get(), part.data(), part.size(), ZMQ_DONTWAIT | more);
  };
  send("1.0", ZMQ_SNDMORE);
  send(request_id_, ZMQ_SNDMORE);
  send(status, ZMQ_SNDMORE);
  send(text, ZMQ_SNDMORE);
  send(user, ZMQ_SNDMORE);
  send("", 0);
}

void Gatekeeper::log_refused(const std::string& key, std::string_view address, Timestamp now) {
  if (logged_at_.size() >= kMaxLoggedRefusals) logged_at_.clear();
  const auto [entry, first] = logged_at_.try_emplace(key, now);
  if (!first && now - entry->second < kRepeatRefusalAfter) return;
  entry->second = now;
  if (audit_ != nullptr) {
    audit_->note({.what = "refused",
                  .who = {.key = key, .address = std::string(address)},
                  .details = {{"socket", who_}, {"reason", "its key is not allowed"}}});
  }
  log_warn(who_, fmt::format("refused a client, address={} key={}: the key is not in {}; mocapctl keys allow adds it",
                             address, key, file_.string()));
}

std::vector<std::string> Gatekeeper::look_for_revoked() {
  refresh();
  return std::exchange(revoked_, {});
}

void Gatekeeper::refresh() {
  if (state_of(file_) == read_state_) return;
  const auto before = allowed_;
  if (const Status read = read_list(); !read) {
    if (!logged_unreadable_) log_error(who_, read.error().message + "; the previous list stays in force");
    logged_unreadable_ = true;
    return;
  }
  logged_unreadable_ = false;
  for (const auto& [key, entry] : before) {
    if (allowed_.count(key) == 0) revoked_.push_back(key);
  }
  note_change(before);
  log_info(who_, fmt::format("reloaded {}, clients={} revoked={}", file_.string(), allowed_.size(), revoked_.size()));
}

// An entry for each key that was allowed, revoked, or got another role or name.
void Gatekeeper::note_change(const std::map<std::string, AllowedKey, std::less<>>& before) const {
  if (audit_ == nullptr) return;
  const auto text = [](const std::map<std::string, AllowedKey, std::less<>>& keys, const std::string& key) {
    const auto found = keys.find(key);
    return found == keys.end() ? std::string("none")
                               : fmt::format("{} {}", name_of(found->second.role), found->second.name);
  };
  auto all = before;
  all.insert(allowed_.begin(), allowed_.end());
  for (const auto& [key, entry] : all) {
    const std::string from = text(before, key), to = text(allowed_, key);
    if (from == to) continue;
    audit_->note({.what = "changed",
                  .details = {{"socket", who_}, {"setting", "allowed key " + key}, {"before", from}, {"after", to}}});
  }
}

std::optional<Role> Gatekeeper::role_of(std::string_view user) const {
  const auto found = allowed_.find(user);
  return found == allowed_.end() ? std::nullopt : std::optional(found->second.role);
}

std::string_view Gatekeeper::name_of_user(std::string_view user) const {
  const auto found = allowed_.find(user);
  return found == allowed_.end() ? std::string_view{} : std::string_view(found->second.name);
}

}  // namespace mocap::wire
