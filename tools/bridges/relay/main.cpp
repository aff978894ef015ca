// mocap-relay: forwards topics of a feed to a NATS server, from which many viewers elsewhere receive them.
#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "bridges/relay/relay.h"
#include "bridges/relay/topics.h"
#include "lib/cli/app.h"
#include "lib/cli/key_options.h"

namespace {

using namespace mocap;  // NOLINT: the program

struct Options {
  relay::RelaySettings relay;
  cli::KeyOptions keys;
  std::string server;
  std::string credentials;
  std::vector<std::string> topics = {"lite/*"};
  bool insecure = false;
};

void add_options(cli::App& app, Options& options) {
  relay::RelaySettings& relay = options.relay;
  app.add_option("endpoint", relay.feed.endpoint, "the feed")->capture_default_str();
  app.add_option("--server", options.server,
                 "the NATS server: tls://HOST[:PORT], nats://HOST[:PORT] without TLS, or HOST[:PORT], which has TLS "
                 "beyond this machine; port 4222")
      ->type_name("SERVER")
      ->required();
  app.add_option("--ca", relay.nats.ca,
                 "certificates of the authorities that sign the server's; without it, the system's")
      ->check(cli::ExistingFile{})
      ->type_name("FILE");
  app.add_option(
         "--credentials", options.credentials,
         "a credentials file of NATS, or a file with a line USER:PASSWORD or a token; only its owner may read it")
      ->type_name("FILE");
  app.add_flag("--insecure", options.insecure,
               "permit nats:// beyond this machine: everybody between can read and change the data");
  app.add_option("--topic", options.topics, "a topic of the feed to forward, or all of a kind; may be repeated")
      ->one_value_each()
      ->capture_default_str();
  app.add_option("--prefix", relay.prefix, "the subjects are mocap.PREFIX.lite.NAME, mocap.PREFIX.description, ...")
      ->capture_default_str();
  app.add_option("--statistics", relay.statistics_s, "log statistics as JSON at this interval, s")
      ->check(cli::PositiveNumber{});
  app.add_option(
         "--status-file", relay.status_file,
         "write the statistics to this file four times a second; without it, to a file that mocapctl bridge list reads")
      ->type_name("FILE");
  app.add_option("--seconds", relay.seconds, "end after this time")->check(cli::PositiveNumber{});
  cli::add_key_options(app, options.keys);
}

// Returns the fault; empty: none.
std::string complete(Options& options) {
  relay::RelaySettings& relay = options.relay;
  const auto server = relay::read_server(options.server);
  if (!server) return fmt::format("--server {}: expected tls://HOST[:PORT] or nats://HOST[:PORT]", options.server);
  if (!server->tls && !server->is_local() && !options.insecure) {
    return fmt::format("--server {} has no TLS: use tls://{}:{}, or give --insecure in a network of your own",
                       options.server, server->host, server->port);
  }
  if (!server->tls && !relay.nats.ca.empty()) {
    return fmt::format("--ca is for TLS: use --server tls://{}:{}", server->host, server->port);
  }
  relay.nats.server = *server;
  if (!options.credentials.empty()) {
    auto read = relay::read_credentials(options.credentials);
    if (!read) return "--credentials " + read.error().message;
    relay.nats.credentials = *read;
  }
  if (!relay::is_subject_prefix(relay.prefix)) {
    return fmt::format("--prefix '{}': expected letters, digits, '-', '_' and dots between them", relay.prefix);
  }
  for (const std::string& topic : options.topics) {
    if (relay::is_topic(topic)) continue;
    return fmt::format(
        "--topic '{}': expected lite/*, lite/NAME, subject/*, subject/NAME, preview/NAME, snapshot, "
        "markers, health or event",
        topic);
  }
  auto keys = wire::load_client_keys(options.keys.server_key, options.keys.secret_key);
  if (!keys) return keys.error().message;
  relay.feed.keys = *keys;
  relay.feed.topics = options.topics;
  relay.feed.topics.emplace_back("description");
  relay.feed.receive_queue = 64;  // older messages are of no use: see Newest
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  cli::App app(
      "Forwards a mocapd feed to a NATS server, from which any number of viewers elsewhere receive it, over one "
      "outgoing connection.",
      "mocap-relay");
  app.footer(R"(examples:
  mocap-relay --server tls://nats.example.org --credentials relay.creds
                                  the small topics lite/NAME of the daemon on this machine
  mocap-relay --server 10.0.0.9 --ca ca.pem --credentials relay.pass
                                  a server with a certificate of your own authority
  mocap-relay --server nats://127.0.0.1 --topic snapshot --topic event
                                  whole snapshots and events, to a server on this machine without TLS
exit codes: 0 forwarded, or ended by a signal, 64 invalid command line, 69 nothing was forwarded in --seconds)");
  add_options(app, options);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  if (const std::string fault = complete(options); !fault.empty()) return app.fail(fault);
  const relay::Server& server = options.relay.nats.server;
  if (!server.tls && !server.is_local()) {
    fmt::print(stderr, "mocap-relay: warning: sends to {} without encryption\n", server.host);
  }
  auto relay = relay::Relay::open(options.relay);
  if (!relay) {
    fmt::print(stderr, "mocap-relay: {}\n", relay.error().message);
    return kExitUsage;
  }
  return (*relay)->run();
}
