#include "ctl/keys_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "ctl/json_line.h"
#include "wire/curve_keys.h"

namespace mocap::ctl {
namespace {

int fail_keys(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", error.message);
  switch (error.code) {
    case ErrorCode::InvalidArgument: return kExitData;
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::Busy:  // the file exists and is kept
    case ErrorCode::Io: return kExitCannotWrite;
    default: return kExitUnavailable;
  }
}

int run_new(const KeysOptions& options) {
  const Result<wire::KeyPair> pair = wire::new_key_pair();
  if (!pair) return fail_keys(pair.error());
  if (const Status saved = wire::save_key_pair(options.file, *pair); !saved) return fail_keys(saved.error());
  if (options.json) {
    fmt::print("{}\n",
               json_line(nlohmann::ordered_json{{"file", options.file.string()}, {"public", pair->public_key}}));
  } else {
    fmt::print("{}: written, readable only by its owner; its public key is\n{}\n", options.file.string(),
               pair->public_key);
  }
  return kExitOk;
}

// Reads the list of allowed keys. A missing file is an empty list.
Result<std::vector<wire::AllowedKey>> read_list(const KeysOptions& options) {
  auto keys = wire::load_allowed_keys(options.list);
  if (!keys && keys.error().code == ErrorCode::NotFound && !std::filesystem::exists(options.list)) {
    return std::vector<wire::AllowedKey>{};
  }
  return keys;
}

int run_allow(const KeysOptions& options) {
  std::string key = options.who;
  if (!wire::is_key(key)) {
    Result<std::string> read = wire::load_public_key(options.who);
    if (!read) return fail_keys(read.error());
    key = *read;
  }
  auto keys = read_list(options);
  if (!keys) return fail_keys(keys.error());
  std::erase_if(*keys, [&](const wire::AllowedKey& known) { return known.public_key == key; });
  const wire::Role role = options.role == "operator" ? wire::Role::Operator : wire::Role::Viewer;
  keys->push_back({key, role, options.name});
  if (const Status saved = wire::save_allowed_keys(options.list, *keys); !saved) return fail_keys(saved.error());
  fmt::print("{}: {} may connect as {}\n", options.list.string(), options.name.empty() ? key : options.name,
             options.role);
  return kExitOk;
}

int run_revoke(const KeysOptions& options) {
  auto keys = wire::load_allowed_keys(options.list);
  if (!keys) return fail_keys(keys.error());
  std::string key = options.who;
  if (const auto read = wire::load_public_key(options.who); read) key = *read;
  const auto gone = std::erase_if(
      *keys, [&](const wire::AllowedKey& known) { return known.public_key == key || known.name == options.who; });
  if (gone == 0) {
    return fail_keys({ErrorCode::InvalidArgument,
                      fmt::format("{}: has no '{}'; see mocapctl keys list", options.list.string(), options.who)});
  }
  if (const Status saved = wire::save_allowed_keys(options.list, *keys); !saved) return fail_keys(saved.error());
  fmt::print("{}: {} removed; a running daemon disconnects them within a second\n", options.list.string(), gone);
  return kExitOk;
}

int run_list(const KeysOptions& options) {
  const auto keys = wire::load_allowed_keys(options.list);
  if (!keys) return fail_keys(keys.error());
  if (options.json) {
    auto all = nlohmann::ordered_json::array();
    for (const auto& key : *keys) {
      all.push_back({{"public", key.public_key}, {"role", name_of(key.role)}, {"name", key.name}});
    }
    fmt::print("{}\n", json_line(all));
    return kExitOk;
  }
  for (const auto& key : *keys) fmt::print("{}  {:8}  {}\n", key.public_key, name_of(key.role), key.name);
  return kExitOk;
}

// The list has one key a line, with its role and its name; '#' begins a comment.
std::optional<std::string> read_client_name(const std::string& text, std::string& name) {
  if (text.empty() || text.find_first_of(" \t\r\n\f\v#") != std::string::npos) {
    return fmt::format("'{}', expected one word without white space and '#'", text);
  }
  name = text;
  return std::nullopt;
}

}  // namespace

void add_keys_command(cli::App& app, KeysOptions& options) {
  cli::App* keys =
      app.add_subcommand("keys", "keys of the clients that may connect to a daemon over the network (CURVE)");
  keys->require_subcommand(1);
  keys->footer(R"(examples:
  mocapctl keys new server.key                       the daemon's own: [security] server_key = "server.key"
  mocapctl keys new anna.key                         a client's; its public line may travel, its secret one never
  mocapctl keys allow anna.key --name anna --role operator --list allowed.keys
                                                     [security] allowed_keys = "allowed.keys"
  mocapctl keys revoke anna --list allowed.keys      a running daemon disconnects anna within a second
  mocapctl status --endpoint tcp://10.0.0.7:5571 --server-key server.key \
      --secret-key anna.key)");
  cli::App* make = keys->add_subcommand("new", "create a key pair");
  make->examples(
      "  mocapctl keys new server.key\n"
      "  mocapctl keys new anna.key --json");
  make->add_option("file", options.file, "file to write, readable only by its owner; must not exist")->required();
  make->callback([&options] { options.run = [&options] { return run_new(options); }; });
  cli::App* allow = keys->add_subcommand("allow", "add a client's key to the list, or change its role");
  allow->examples("  mocapctl keys allow anna.key --name anna --role operator --list allowed.keys");
  allow->add_option("key", options.who, "a public key, or a file with one")->required();
  allow
      ->add_option(
          "--name", [&options](const std::string& text) { return read_client_name(text, options.name); },
          "name of the client for lists and the log: one word")
      ->type_name("NAME");
  allow->add_option("--role", options.role, "viewer: reads data and state; operator: also changes the state")
      ->check(cli::IsMember({"viewer", "operator"}))
      ->capture_default_str();
  allow->callback([&options] { options.run = [&options] { return run_allow(options); }; });
  cli::App* revoke = keys->add_subcommand("revoke", "remove a client's key from the list");
  revoke->examples("  mocapctl keys revoke anna --list allowed.keys");
  revoke->add_option("key", options.who, "a public key, a file with one, or a name")->required();
  revoke->callback([&options] { options.run = [&options] { return run_revoke(options); }; });
  cli::App* list = keys->add_subcommand("list", "show the clients that may connect");
  list->examples("  mocapctl keys list --list allowed.keys --json");
  list->callback([&options] { options.run = [&options] { return run_list(options); }; });
  for (cli::App* command : {allow, revoke, list}) {
    command->add_option("--list", options.list, "the list of allowed keys")->type_name("FILE")->capture_default_str();
  }
  for (cli::App* command : {make, list}) command->add_flag("--json", options.json, "print JSON");
}

}  // namespace mocap::ctl
