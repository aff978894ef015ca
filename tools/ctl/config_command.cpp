#include "ctl/config_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/exit_codes.h"
#include "ctl/json_line.h"
#include "settings/settings_in_force.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;

// Folders of systemd/mocapd.service.
constexpr const char* kServiceConfig = "/etc/mocapd/mocapd.toml";
constexpr const char* kServiceState = "/var/lib/mocapd";

struct ConfigOptions {
  fs::path config = kServiceConfig;
  std::string state;
  bool changed = false;
  bool json = false;
};

// The state folder: the option, otherwise that of the service if the configuration is that of the service.
fs::path state_folder(const ConfigOptions& options) {
  if (!options.state.empty()) return options.state == "none" ? fs::path{} : fs::path(options.state);
  std::error_code ignored;
  const bool service = fs::weakly_canonical(options.config, ignored) == fs::weakly_canonical(kServiceConfig, ignored);
  return service ? fs::path(kServiceState) : settings::state_folder_of_service();
}

void print_json(const settings::InForce& all) {
  auto files = nlohmann::ordered_json::array(), values = nlohmann::ordered_json::array();
  for (const auto& file : all.files) {
    files.push_back({{"file", file.path.string()}, {"content", file.content}, {"exists", file.exists}});
  }
  for (const auto& setting : all.settings) {
    values.push_back({{"key", setting.key}, {"value", setting.value}, {"from", setting.from}});
  }
  nlohmann::ordered_json notes = all.notes;
  fmt::print("{}\n", json_line(nlohmann::ordered_json{{"files", files}, {"notes", notes}, {"settings", values}}, 2));
}

void print_text(const settings::InForce& all, bool only_changed) {
  fmt::print("# read in this order\n");
  for (std::size_t i = 0; i < all.files.size(); ++i) {
    fmt::print("# {} {}  {}{}\n", i + 1, all.files[i].path.string(), all.files[i].content,
               all.files[i].exists ? "" : " (not there yet)");
  }
  for (const std::string& note : all.notes) fmt::print("# {}\n", note);
  for (const auto& setting : all.settings) {
    if (only_changed && setting.from == "default") continue;
    fmt::print("{} = {}  # {}\n", setting.key, setting.value, setting.from);
  }
}

int run_show(const ConfigOptions& options) {
  const fs::path folder = state_folder(options);
  std::error_code denied;
  fs::directory_iterator(folder, denied);
  if (!folder.empty() && denied == std::errc::permission_denied) {
    fmt::print(stderr, "mocapctl: {} cannot be read; run mocapctl config show as root (sudo)\n", folder.string());
    return kExitNoPerm;
  }
  const auto all = settings::settings_in_force(options.config, settings::state_files(folder));
  if (!all) {
    fmt::print(stderr, "{}\n", settings::to_text(all.error()));
    return kExitConfig;
  }
  options.json ? print_json(*all) : print_text(*all, options.changed);
  return kExitOk;
}

}  // namespace

void add_config_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<ConfigOptions>();
  cli::App* const config = app.add_subcommand("config", "the settings that a daemon runs with");
  config->require_subcommand(1);
  config->footer(R"(examples:
  mocapctl config show                      every value of the service and the file and line it comes from
  mocapctl config show --changed            only values that a file sets
  mocapctl config show --config my.toml     of a configuration without a state folder)");
  cli::App* const show = config->add_subcommand("show", "every value in force, and the file and line it comes from");
  show->add_option("--config", options->config, "the configuration")->type_name("FILE")->capture_default_str();
  show->add_option("--state", options->state,
                   "folder of the files that the daemon writes, or none; default: /var/lib/mocapd for the service's "
                   "configuration, otherwise $STATE_DIRECTORY")
      ->type_name("DIR");
  show->add_flag("--changed", options->changed, "leave out defaults");
  show->add_flag("--json", options->json, "print JSON");
  show->callback([options, &chosen] { chosen = [options] { return run_show(*options); }; });
}

}  // namespace mocap::ctl
