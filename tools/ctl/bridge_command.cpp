#include "ctl/bridge_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>
#include <vector>

#include "base/exit_codes.h"
#include "bridges/status/status_file.h"
#include "ctl/json_line.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double kStale_s = 5.0;  // a bridge writes its status once a second
constexpr std::uintmax_t kLargest_bytes = 1024 * 1024;

struct BridgeOptions {
  std::string folder;
  bool json = false;
};

std::vector<fs::path> folders_of(const BridgeOptions& options) {
  if (!options.folder.empty()) return {options.folder};
  return {bridge::status_folder_of_services(), bridge::status_folder_of_user()};
}

double age_s(const fs::path& file) {
  std::error_code ignored;
  const auto written = fs::last_write_time(file, ignored);
  return std::chrono::duration<double>(fs::file_time_type::clock::now() - written).count();
}

// Nothing if the file is no status of a bridge: another program may write to the same folder.
Json read_status(const fs::path& file) {
  std::error_code failed;
  if (fs::file_size(file, failed) > kLargest_bytes || failed) return {};
  std::ifstream in(file);
  Json status = Json::parse(in, nullptr, false);
  if (!status.is_object() || !status.value("program", Json()).is_string()) return {};
  if (!status.value("receivers", Json()).is_array()) return {};
  status["age_s"] = age_s(file);
  return status;
}

// The status files of a folder and of its direct subfolders, by path.
std::vector<fs::path> status_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (auto it = fs::recursive_directory_iterator(folder, fs::directory_options::skip_permission_denied, ignored);
       it != fs::recursive_directory_iterator(); it.increment(ignored)) {
    if (it.depth() > 0) it.disable_recursion_pending();
    if (it->path().extension() == ".json") files.push_back(it->path());
  }
  std::ranges::sort(files);
  return files;
}

std::string text_of(const Json& object, const char* key) {
  const Json value = object.value(key, Json());
  return value.is_string() ? value.get<std::string>() : "";
}

double number_of(const Json& object, const char* key) {
  const Json value = object.value(key, Json());
  return value.is_number() ? value.get<double>() : 0.0;
}

void print_text(const Json& bridges) {
  if (bridges.empty()) {
    fmt::print("no bridge runs on this machine; start one with: systemctl enable --now mocap-bridge@natnet\n");
  }
  for (const Json& each : bridges) {
    const Json& receivers = each["receivers"];
    if (number_of(each, "age_s") > kStale_s) {
      fmt::print("{}: no status for {:.0f} s: the bridge was killed or hangs\n", text_of(each, "program"),
                 number_of(each, "age_s"));
      continue;
    }
    fmt::print("{}: {} receiver{}, {:.0f} packets sent, {:.0f} dropped, adds {:.2f} ms (p99); {}\n",
               text_of(each, "program"), receivers.size(), receivers.size() == 1 ? "" : "s", number_of(each, "sent"),
               number_of(each, "dropped"), number_of(each, "added_p99_us") * 1e-3, text_of(each, "diagnosis"));
    for (const Json& receiver : receivers) {
      if (receiver.is_object()) fmt::print("  {:21} {}\n", text_of(receiver, "address"), text_of(receiver, "settings"));
    }
  }
}

int run_list(const BridgeOptions& options) {
  Json bridges = Json::array();
  for (const fs::path& folder : folders_of(options)) {
    for (const fs::path& file : status_files(folder)) {
      if (Json status = read_status(file); !status.is_null()) bridges.push_back(std::move(status));
    }
  }
  if (options.json) {
    fmt::print("{}\n", json_line(bridges, 2));
  } else {
    print_text(bridges);
  }
  return kExitOk;
}

}  // namespace

void add_bridge_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<BridgeOptions>();
  cli::App* const bridge =
      app.add_subcommand("bridge", "the bridges to other protocols (NatNet, VRPN, Rokoko, VMC, NATS)");
  bridge->require_subcommand(1);
  bridge->footer(R"(examples:
  mocapctl bridge list           the bridges of this machine, and who is connected to each
  mocapctl bridge list --json    all counts, for programs)");
  cli::App* const list = bridge->add_subcommand("list", "the bridges of this machine, and who is connected to each");
  list->add_option("--folder", options->folder,
                   "folder of the status files; default: those of the services and of your own programs")
      ->type_name("DIR");
  list->add_flag("--json", options->json, "print JSON");
  list->callback([options, &chosen] { chosen = [options] { return run_list(*options); }; });
}

}  // namespace mocap::ctl
