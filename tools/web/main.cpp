// mocap-web: shows a mocapd in the browser; metrics and control for other programs.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "lib/cli/app.h"
#include "lib/cli/key_options.h"
#include "web/access/certificate.h"
#include "web/access/tokens.h"
#include "web/http/server.h"

namespace {

using namespace mocap;  // NOLINT: the program

constexpr const char* kExamples = R"(examples:
  mocap-web                                  the daemon on this machine, at http://127.0.0.1:5580
  mocap-web tcp://10.0.0.7:5570 --server-key server.key --secret-key web.key
                                             a daemon that demands keys; its page is for this machine alone
  mocap-web --role viewer                    nobody can change the daemon
  mocap-web cert web && mocap-web token web.tokens anna --role operator
  mocap-web --listen 0.0.0.0 --certificate web.crt --private-key web.key --tokens web.tokens
                                             for other machines: https, and a token for each person
exit codes: 0 stopped, 64 invalid command line, key, certificate or token file,
69 the port is in use or the address is not of this machine, 73 a file cannot
be written)";

struct Options {
  web::ServerSettings server;
  cli::KeyOptions keys;
  std::string tokens;
  int port = 5580;
  std::vector<std::string> names;
};

struct TokenOptions {
  std::string file;
  web::Token token;
};

struct CertificateOptions {
  std::string prefix;
  std::vector<std::string> names;
  int days = 825;
};

int fail(const std::string& why, int code) {
  fmt::print(stderr, "mocap-web: {}\n", why);
  return code;
}

int exit_code_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::Busy:
    case ErrorCode::Io: return kExitUnavailable;
    default: return kExitUsage;
  }
}

void add_role(cli::App& app, wire::Role& role, const std::string& help) {
  app.add_choice<wire::Role>("--role", role, {{"viewer", wire::Role::Viewer}, {"operator", wire::Role::Operator}},
                             help);
}

void add_options(cli::App& app, Options& options) {
  app.add_option("endpoint", options.server.feed, "the feed")->capture_default_str();
  app.add_option("--control", options.server.control,
                 "the daemon's control endpoint; default: the port after the feed's")
      ->type_name("ENDPOINT");
  cli::add_key_options(app, options.keys);
  app.add_option("--takes", options.server.takes,
                 "folder of the recorded takes, [takes] folder of the daemon; default: that of the take which the "
                 "daemon reports, if the endpoint is ipc or a loopback address and the take is readable")
      ->type_name("FOLDER");
  app.add_option("--listen", options.server.listen,
                 "address of this machine that browsers reach; 0.0.0.0 and ::: all. Beyond this machine "
                 "TLS and tokens are needed")
      ->capture_default_str();
  app.add_option("--port", options.port, "TCP port; 0: a free one")->check(cli::Range(0, 65535))->capture_default_str();
  app.add_option("--name", options.names, "a host name of this machine that browsers may use; may be repeated")
      ->type_name("NAME");
  app.add_option("--origin", options.server.access.origins,
                 "a site whose pages may read the feed by the Foxglove protocol, as https://app.foxglove.dev; may be "
                 "repeated")
      ->type_name("SITE");
  app.add_option("--certificate", options.server.certificate, "the server's certificate, PEM")->type_name("FILE");
  app.add_option("--private-key", options.server.private_key, "the certificate's key, PEM")->type_name("FILE");
  app.add_option("--tokens", options.tokens, "file of mocap-web token: who may see and do what")->type_name("FILE");
  add_role(app, options.server.access.role_without_token,
           "without --tokens: the role of every browser; default: operator");
  app.add_option("--timeout-s", options.server.timeout_s,
                 "cut a client that is silent, or does not read, for this time")
      ->check(cli::Range(1.0, 3600.0))
      ->capture_default_str();
}

std::string complete(Options& options) {
  web::ServerSettings& server = options.server;
  if (server.certificate.empty() != server.private_key.empty())
    return "--certificate and --private-key need each other";
  auto keys = wire::load_client_keys(options.keys.server_key, options.keys.secret_key);
  if (!keys) return keys.error().message;
  server.keys = *std::move(keys);
  server.port = static_cast<std::uint16_t>(options.port);
  server.access.names = web::names_of_this_machine();
  for (const std::string& name : options.names) server.access.names.push_back(web::host_name_in(name));
  for (std::string& origin : server.access.origins) {
    if (origin.find("://") == std::string::npos) return "--origin " + origin + ": expected a site as https://HOST";
    std::ranges::transform(origin, origin.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  }
  server.access.open = options.tokens.empty();
  if (server.access.open) return {};
  auto tokens = web::load_tokens(options.tokens);
  if (!tokens) return tokens.error().message;
  server.access.tokens = *std::move(tokens);
  return {};
}

int serve(Options& options) {
  if (const std::string fault = complete(options); !fault.empty()) return fail(fault, kExitUsage);
  const auto server = web::Server::open(options.server);
  if (!server) return fail(server.error().message, exit_code_of(server.error().code));
  fmt::print("mocap-web: {}\n", (*server)->address());
  std::fflush(stdout);
  (*server)->run();
  if ((*server)->waits()) std::_Exit(kExitOk);
  return kExitOk;
}

int make_token(TokenOptions& options) {
  const std::string token = web::new_token();
  options.token.sha256 = web::sha256_of(token);
  if (const Status saved = web::append_token(options.file, options.token); !saved) {
    return fail(saved.error().message, saved.error().code == ErrorCode::Io ? kExitCannotWrite : kExitUsage);
  }
  fmt::print("{}\n", token);
  return kExitOk;
}

int make_certificate(const CertificateOptions& options) {
  std::vector<std::string> names = web::names_of_this_machine();
  names.insert(names.end(), options.names.begin(), options.names.end());
  const auto made = web::make_certificate(options.prefix, names, options.days);
  if (!made)
    return fail(made.error().message, made.error().code == ErrorCode::InvalidArgument ? kExitUsage : kExitCannotWrite);
  fmt::print("{} {}\nSHA-256 {}\n", made->certificate.string(), made->private_key.string(), made->sha256);
  return kExitOk;
}

void add_token(cli::App& app, TokenOptions& options, std::function<int()>& chosen) {
  cli::App* token = app.add_subcommand("token", "make a token for a person or a program, and print it");
  token->add_option("file", options.file, "file of the tokens; it has the hash alone")->required()->type_name("FILE");
  token->add_option("name", options.token.name, "owner, for the log; one word")->required()->type_name("NAME");
  add_role(*token, options.token.role, "viewer sees, operator also changes; default: viewer");
  token->examples("  mocap-web token web.tokens anna --role operator");
  token->callback([&] { chosen = [&options] { return make_token(options); }; });
}

void add_certificate(cli::App& app, CertificateOptions& options, std::function<int()>& chosen) {
  cli::App* cert = app.add_subcommand("cert", "make a certificate of its own for https");
  cert->add_option("prefix", options.prefix, "the files are PREFIX.crt and PREFIX.key")
      ->required()
      ->type_name("PREFIX");
  cert->add_option("--name", options.names, "a further name or address of this machine; may be repeated")
      ->type_name("NAME");
  cert->add_option("--days", options.days, "validity")->check(cli::Range(1, 3650))->capture_default_str();
  cert->examples("  mocap-web cert web --name 10.0.0.7");
  cert->callback([&] { chosen = [&options] { return make_certificate(options); }; });
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  TokenOptions token;
  CertificateOptions certificate;
  std::function<int()> chosen;
  cli::App app("Shows a mocapd in the browser, with metrics and an API for other programs.", "mocap-web");
  app.footer(kExamples);
  add_options(app, options);
  add_token(app, token, chosen);
  add_certificate(app, certificate, chosen);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return chosen ? chosen() : serve(options);
}
