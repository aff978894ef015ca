#include "wire/wire_settings.h"

#include "base/result.h"
#include "wire/endpoint.h"

namespace mocap::wire {

namespace {

// With CURVE every client is authenticated, so other machines may connect.
template <class Listening>
std::vector<KeyFault> endpoint_faults(const Listening& listening) {
  const bool remote = listening.allow_remote || listening.curve.on();
  std::vector<KeyFault> faults;
  const auto check = [&](const char* key, const std::string& endpoint) {
    const Status good = check_endpoint(endpoint, remote);
    // Only InvalidArgument is a fault of the file.
    if (!good && good.error().code == ErrorCode::InvalidArgument) faults.push_back({key, good.error().message});
  };
  check("endpoint", listening.endpoint);
  for (const std::string& endpoint : listening.more_endpoints) check("more_endpoints", endpoint);
  return faults;
}

}  // namespace

void declare_keys(KeyVisitor& keys, CurveSettings& curve) {
  keys.path("server_key", curve.server_key,
            {.help = "the server's own key, a file made by mocapctl keys new that only its owner may read, or "
                     "\"$CREDENTIALS_DIRECTORY/server.key\" with LoadCredential= of systemd; \"\": clients are not "
                     "authenticated"});
  keys.path("allowed_keys", curve.allowed,
            {.help = "list of clients' keys, a file made by mocapctl keys allow; read again when it changes"});
}

void declare_keys(KeyVisitor& keys, PublisherSettings& feed) {
  keys.text("endpoint", feed.endpoint, {.help = "tcp://ADDRESS:PORT (port * takes a free one) or ipc://PATH"});
  keys.texts("more_endpoints", feed.more_endpoints,
             {.help = "further endpoints, such as [\"ipc:///run/mocapd/feed\"]"});
  keys.flag("allow_remote", feed.allow_remote,
            {.help = "true: other machines may connect although [security] authenticates no clients"});
  keys.number("max_connections", feed.max_connections, {1, 60000},
              {.help = "the newest connections over this number are closed"});
  keys.number("send_queue", feed.send_queue, {1, 1000},
              {.help = "messages that wait for one slow subscriber, never fewer than 204, two of each topic of 16 "
                       "subjects; further ones are dropped for this subscriber alone"});
  keys.flag("velocities", feed.velocities,
            {.help = "true: velocities and angular velocities of the bones are published, too, about 24 bytes a bone"});
  keys.number(
      "lite_hz", feed.lite_hz, {1.0, 1000.0},
      {.help =
           "largest rate of the topics lite/NAME, Hz, for many or far viewers: at most 199 bytes a message, which has "
           "up to 27 bones"});
}

void declare_keys(KeyVisitor& keys, ControlSettings& control) {
  keys.text("endpoint", control.endpoint,
            {.help = "\"\": beside the feed, its port + 1 or its path + \".control\"; \"none\": no requests"});
  keys.texts("more_endpoints", control.more_endpoints, {.help = "further endpoints"});
  keys.flag("allow_remote", control.allow_remote, {.help = "as in [publish]"});
  keys.choice<Role>("role_without_keys", control.role_without_keys,
                    {{name_of(Role::Viewer), Role::Viewer}, {name_of(Role::Operator), Role::Operator}},
                    {.help = "rights of every client if [security] authenticates no clients; viewer: no changes"});
}

void declare_keys(KeyVisitor& keys, NodeSettings& node) {
  keys.text(
      "endpoint", node.endpoint,
      {.help = "where fusion hosts fetch the blobs: tcp://ADDRESS:PORT or ipc://PATH; \"\": this daemon is no node",
       .example = "tcp://127.0.0.1:5575"});
  keys.texts("more_endpoints", node.more_endpoints, {.help = "further endpoints"});
  keys.text("name", node.name, {.help = "in the health report of the fusion host; \"\": the host name"});
  keys.flag("allow_remote", node.allow_remote, {.help = "as in [publish]"});
  keys.number("send_queue", node.send_queue, {2, 1000},
              {.help = "images of one camera that wait for a slow fusion host; further ones are lost and counted"});
  keys.flag(
      "announce", node.announce,
      {.help =
           "announce the name and port of this node in the network by DNS-SD, for mocapctl nodes; needs avahi-daemon, "
           "and an endpoint beyond loopback"});
}

std::vector<KeyFault> faults_of(const CurveSettings& curve) {
  if (curve.on() != curve.allowed.empty()) return {};
  return {{curve.on() ? "server_key" : "allowed_keys",
           "server_key and allowed_keys go together: the server's own key, and the list of clients' keys; see mocapctl "
           "keys --help"}};
}

std::vector<KeyFault> faults_of(const PublisherSettings& feed) { return endpoint_faults(feed); }

std::vector<KeyFault> faults_of(const ControlSettings& control) {
  if (control.endpoint.empty() || control.endpoint == "none") return {};
  return endpoint_faults(control);
}

std::vector<KeyFault> faults_of(const NodeSettings& node) {
  return node.on() ? endpoint_faults(node) : std::vector<KeyFault>{};
}

}  // namespace mocap::wire
