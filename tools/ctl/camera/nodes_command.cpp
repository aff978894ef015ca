#include "ctl/camera/nodes_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "cameras/node/node_settings.h"
#include "ctl/camera/node_probe.h"
#include "ctl/json_line.h"
#include "settings/daemon_settings.h"
#include "wire/discovery/announced_nodes.h"

namespace mocap::ctl {
namespace {

constexpr Duration kBrowsePatience = std::chrono::seconds(3);

struct NodesOptions {
  std::filesystem::path config;
  double seconds = 2.0;
  bool json = false;
};

// One node: of the configuration, of an announcement, or of both.
struct ListedNode {
  NodeAddress address;
  std::map<std::string, std::string> used_as;  // by name on the node: name in the configuration
  bool configured = false;
  bool announced = false;
  bool wants_key = false;  // of an announcement: no key is known for it
  NodeAnswer answer = {};

  bool in_order() const { return answer.echo.has_value() || !configured; }
};

Result<std::vector<ListedNode>> configured_nodes(const std::filesystem::path& config) {
  std::vector<ListedNode> nodes;
  if (config.empty()) return nodes;
  const auto settings = settings::load_daemon_settings(config);
  if (!settings) return Error{ErrorCode::InvalidArgument, settings::to_text(settings.error())};
  for (const cameras::CameraSettings& camera : settings->cameras) {
    const auto* const node = camera.driver.as<cameras::NodeCameraSettings>();
    if (node == nullptr) continue;
    const auto at = [&](const ListedNode& each) { return each.address.endpoint == node->endpoint; };
    auto found = std::ranges::find_if(nodes, at);
    if (found == nodes.end()) {
      const Result<wire::ClientKeys> keys = wire::load_client_keys(node->server_key, node->secret_key.string());
      if (!keys) return keys.error();
      ListedNode& added = nodes.emplace_back();
      added.address = {node->endpoint, *keys};
      added.configured = true;
      found = std::prev(nodes.end());
    }
    found->used_as[node->camera.empty() ? camera.name : node->camera] = camera.name;
  }
  return nodes;
}

// Marks the announced ones among `nodes` and adds the others.
void add_announced(std::vector<ListedNode>& nodes, const std::vector<wire::FoundNode>& announced) {
  for (const wire::FoundNode& node : announced) {
    const auto found =
        std::ranges::find_if(nodes, [&](const ListedNode& each) { return each.address.endpoint == node.endpoint; });
    if (found != nodes.end()) {
      found->announced = true;
      continue;
    }
    ListedNode& added = nodes.emplace_back();
    added.address.endpoint = node.endpoint;
    added.announced = true;
    added.wants_key = node.keys;
    added.answer = {node.endpoint, {}, "it authenticates its hosts: give server_key and secret_key in a [[camera]]"};
  }
}

void probe(std::vector<ListedNode>& nodes, Duration patience) {
  std::vector<NodeAddress> addresses;
  for (const ListedNode& node : nodes) {
    if (!node.wants_key) addresses.push_back(node.address);
  }
  for (NodeAnswer& answer : probe_nodes(addresses, patience)) {
    const auto of = [&](const ListedNode& each) { return each.address.endpoint == answer.endpoint; };
    std::ranges::find_if(nodes, of)->answer = std::move(answer);
  }
}

std::string_view word_of(NodeCameraState state) {
  switch (state) {
    case NodeCameraState::NotYet: return "no image yet";
    case NodeCameraState::Delivering: return "delivering";
    case NodeCameraState::Ended: return "stopped";
  }
  return "unknown";
}

std::string use_of(const ListedNode& node, const std::string& camera) {
  const auto used = node.used_as.find(camera);
  return used == node.used_as.end() ? "" : used->second;
}

void print_node(const ListedNode& node) {
  const std::string origin = !node.configured ? ", announced, not in the configuration"
                             : node.announced ? ", announced"
                                              : "";
  if (!node.answer.echo) {
    fmt::print("{}{}: {}\n", node.address.endpoint, origin, node.answer.fault);
    return;
  }
  const wire::NodeEcho& echo = *node.answer.echo;
  fmt::print("{}: node '{}'{}, round trip {:.0f} us{}\n", node.address.endpoint, echo.node, origin,
             to_us(round_trip(echo)), echo.recorded ? ", plays a recording" : "");
  for (const NodeCamera& camera : echo.cameras) {
    const std::string used = use_of(node, camera.name);
    fmt::print("  {:<16} {:<10} {:<13}{}\n", camera.name,
               camera.width_px == 0 ? "-" : fmt::format("{}x{}", camera.width_px, camera.height_px),
               word_of(camera.state), used.empty() ? "" : "camera " + used);
  }
  for (const auto& [there, here] : node.used_as) {
    if (std::ranges::find(echo.cameras, there, &NodeCamera::name) != echo.cameras.end()) continue;
    fmt::print("  {:<16} missing on the node; camera {} of the configuration names it\n", there, here);
  }
}

nlohmann::ordered_json json_of(const ListedNode& node) {
  nlohmann::ordered_json entry{{"endpoint", node.address.endpoint},
                               {"configured", node.configured},
                               {"announced", node.announced},
                               {"answers", node.answer.echo.has_value()}};
  if (!node.answer.echo) {
    entry["fault"] = node.answer.fault;
    return entry;
  }
  const wire::NodeEcho& echo = *node.answer.echo;
  entry["name"] = echo.node;
  entry["round_trip_us"] = to_us(round_trip(echo));
  entry["recorded"] = echo.recorded;
  entry["control"] = echo.control;
  entry["cameras"] = nlohmann::ordered_json::array();
  for (const NodeCamera& camera : echo.cameras) {
    entry["cameras"].push_back({{"name", camera.name},
                                {"width_px", camera.width_px},
                                {"height_px", camera.height_px},
                                {"state", word_of(camera.state)},
                                {"used_as", use_of(node, camera.name)}});
  }
  return entry;
}

void print_all(const std::vector<ListedNode>& nodes, const Result<std::vector<wire::FoundNode>>& announced, bool json) {
  if (json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const ListedNode& node : nodes) list.push_back(json_of(node));
    fmt::print("{}\n", json_line(list));
    return;
  }
  for (const ListedNode& node : nodes) print_node(node);
  if (!announced) {
    fmt::print("not searched in the network: {}\n", announced.error().message);
  } else if (nodes.empty()) {
    fmt::print("no node announces itself; nodes that cannot are named in a configuration: --config FILE\n");
  }
}

int run_nodes(const NodesOptions& options) {
  Result<std::vector<ListedNode>> nodes = configured_nodes(options.config);
  if (!nodes) {
    fmt::print(stderr, "mocapctl: {}\n", nodes.error().message);
    return kExitConfig;
  }
  const Result<std::vector<wire::FoundNode>> announced = wire::announced_nodes(kBrowsePatience);
  if (announced) add_announced(*nodes, *announced);
  probe(*nodes, from_s(options.seconds));
  print_all(*nodes, announced, options.json);
  return std::ranges::all_of(*nodes, &ListedNode::in_order) ? kExitOk : kExitUnavailable;
}

}  // namespace

void add_nodes_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<NodesOptions>();
  cli::App* const command = app.add_subcommand("nodes", "the camera nodes of the network and of a configuration");
  command->examples(
      "  mocapctl nodes\n"
      "  mocapctl nodes --config /etc/mocapd/mocapd.toml --json");
  command->add_option("--config", options->config, "the fusion host's configuration: its nodes, and the keys for them")
      ->check(cli::ExistingFile{});
  command->add_option("--seconds", options->seconds, "wait at most this long for the answers")
      ->capture_default_str()
      ->check(cli::Range(0.1, 60.0));
  command->add_flag("--json", options->json, "a JSON array");
  command->callback([options, &chosen] {
    chosen = [options] {
      set_log_level(LogLevel::Warn);
      return run_nodes(*options);
    };
  });
}

}  // namespace mocap::ctl
