#include "wire/endpoint.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <zmq.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr std::string_view kTcp = "tcp://";
constexpr std::string_view kIpc = "ipc://";

Error bad_endpoint(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

std::string_view host_of(std::string_view tcp_endpoint) {
  const std::string_view rest = tcp_endpoint.substr(kTcp.size());
  return rest.substr(0, rest.rfind(':'));
}

// Accepts only numeric addresses: a name that starts with "127." (127.example.org) may belong to any machine.
bool is_loopback_v4(std::string_view host) {
  return host.starts_with("127.") && std::count(host.begin(), host.end(), '.') == 3 &&
         host.find_first_not_of("0123456789.") == std::string_view::npos;
}

std::string_view port_of(std::string_view endpoint) { return endpoint.substr(endpoint.rfind(':') + 1); }

Status check_tcp(std::string_view endpoint) {
  const std::string_view rest = endpoint.substr(kTcp.size());
  const auto colon = rest.rfind(':');
  const std::string_view port = colon == std::string_view::npos ? "" : rest.substr(colon + 1);
  if (colon == 0 || colon == std::string_view::npos || port.empty()) {
    return bad_endpoint(fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT", endpoint));
  }
  if (port == "*") return {};
  unsigned number = 0;
  const auto [end, fault] = std::from_chars(port.data(), port.data() + port.size(), number);
  if (fault != std::errc{} || end != port.data() + port.size() || number > 65535) {
    return bad_endpoint(
        fmt::format("endpoint '{}': port is '{}', expected 0 to 65535 or * (a free one)", endpoint, port));
  }
  return {};
}

Status check_ipc(std::string_view endpoint) {
  const std::string_view path = endpoint.substr(kIpc.size());
  const sockaddr_un address{};
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return bad_endpoint(fmt::format("endpoint '{}': the path has {} characters, expected 1 to {}", endpoint,
                                    path.size(), sizeof(address.sun_path) - 1));
  }
  return {};
}

bool has_port_of(std::string_view one, std::string_view other) {
  return one.starts_with(kTcp) && other.starts_with(kTcp) && port_of(one) == port_of(other);
}

// Whether a socket at `host` also listens at `other`.
bool has_host(std::string_view host, std::string_view other) {
  return host == other || host == "*" || host == "[::]" || (host == "0.0.0.0" && !other.starts_with('['));
}

// Whether two sockets cannot listen at these endpoints at once.
bool same_place(std::string_view one, std::string_view other) {
  if (!one.starts_with(kTcp)) return one == other && !one.ends_with('*');
  if (!has_port_of(one, other) || port_of(one) == "*" || port_of(one) == "0") return false;
  return has_host(host_of(one), host_of(other)) || has_host(host_of(other), host_of(one));
}

Error failure_at(const std::string& endpoint, int code) {
  errno = code;
  return zmq_failure(fmt::format("endpoint '{}'", endpoint));
}

Status try_tcp(ZmqSocket& socket, const std::string& endpoint, const std::vector<std::string>& own) {
  std::string tried = endpoint;
  const auto has_port = [&](const std::string& other) { return has_port_of(other, endpoint); };
  if (std::ranges::any_of(own, has_port)) tried.replace(tried.rfind(':'), std::string::npos, ":*");
  if (Status set = socket.set(ZMQ_IPV6, tried.starts_with("tcp://[") ? 1 : 0); !set) return set;
  if (zmq_bind(socket.get(), tried.c_str()) != 0) return failure_at(endpoint, zmq_errno());
  return {};
}

// A bind would replace the socket file of another program, so none is tried.
Status try_ipc(const std::string& endpoint) {
  if (is_taken_ipc(endpoint)) return failure_at(endpoint, EADDRINUSE);
  const std::string path = endpoint.substr(kIpc.size());
  if (path == "*" || path.starts_with('@')) return {};
  const auto slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  if (::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) != 0) return failure_at(endpoint, errno);
  return {};
}

}  // namespace

bool is_local(std::string_view endpoint) {
  if (endpoint.starts_with(kIpc)) return true;
  if (!endpoint.starts_with(kTcp)) return false;
  const std::string_view host = host_of(endpoint);
  return host == "localhost" || host == "[::1]" || host == "lo" || is_loopback_v4(host);
}

Status check_endpoint(const std::string& endpoint, bool allow_remote) {
  if (endpoint.find('\0') != std::string::npos) return bad_endpoint("endpoint has a zero byte");
  const bool tcp = endpoint.starts_with(kTcp);
  if (!tcp && !endpoint.starts_with(kIpc)) {
    return bad_endpoint(fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT or ipc://PATH", endpoint));
  }
  if (const Status shape = tcp ? check_tcp(endpoint) : check_ipc(endpoint); !shape) return shape;
  if (!allow_remote && !is_local(endpoint)) {
    return bad_endpoint(
        fmt::format("endpoint '{}': other machines can reach it and clients are not authenticated; listen at "
                    "tcp://127.0.0.1:5570, authenticate clients with [security] (mocapctl keys), or set "
                    "allow_remote = true to permit unauthenticated clients",
                    endpoint));
  }
  return {};
}

Status try_endpoints(const std::vector<std::string>& endpoints, const std::vector<std::string>& own) {
  ZmqContext context;
  ZmqSocket socket;
  if (Status opened = socket.open(context, ZMQ_ROUTER, "endpoint"); !opened) return opened;
  for (auto endpoint = endpoints.begin(); endpoint != endpoints.end(); ++endpoint) {
    const bool is_own = std::ranges::find(own, *endpoint) != own.end();
    const auto is_same = [&](const std::string& other) {
      const bool both_own = is_own && std::ranges::find(own, other) != own.end();
      return both_own ? other == *endpoint : same_place(*endpoint, other);
    };
    if (std::any_of(endpoints.begin(), endpoint, is_same)) {
      return Error{ErrorCode::Busy,
                   fmt::format("endpoint '{}': another endpoint of this configuration is there; choose another port "
                               "for one of them",
                               *endpoint)};
    }
    if (is_own) continue;
    const Status tried = endpoint->starts_with(kTcp) ? try_tcp(socket, *endpoint, own) : try_ipc(*endpoint);
    if (!tried) return tried;
  }
  return {};
}

bool is_taken_ipc(const std::string& endpoint) {
  if (!endpoint.starts_with(kIpc)) return false;
  const std::string_view path = std::string_view(endpoint).substr(kIpc.size());
  sockaddr_un address{};
  if (path == "*" || path.starts_with('@') || path.size() >= sizeof(address.sun_path)) return false;
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  const int probe = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (probe < 0) return false;  // the bind will report an endpoint in use
  const bool taken = ::connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  ::close(probe);
  return taken;
}

}  // namespace mocap::wire
