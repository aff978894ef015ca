#include "ctl/camera/node_probe.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

namespace mocap::ctl {
namespace {

constexpr int kEchoes = 8;  // the shortest round trip of these
constexpr Duration kCallEvery = std::chrono::milliseconds(20);
constexpr Duration kOneAtATime = std::chrono::milliseconds(1);

struct Probe {
  NodeAnswer answer;
  std::unique_ptr<wire::NodeLink> link;
  int echoes = 0;

  bool done() const { return !link || echoes >= kEchoes; }

  void take(const wire::NodeEcho& echo) {
    ++echoes;
    if (!answer.echo || round_trip(echo) < round_trip(*answer.echo)) answer.echo = echo;
  }

  void read() {
    const Result<wire::NodeNews> news = link->next(kOneAtATime);
    if (news && *news == wire::NodeNews::Echo) return take(link->echo());
    if (news && *news == wire::NodeNews::Refusal) answer.fault = link->refusal();
    if (!news && news.error().code != ErrorCode::Timeout) answer.fault = news.error().message;
    if (!answer.fault.empty()) link.reset();
  }
};

Probe begin(const NodeAddress& node) {
  Probe probe;
  probe.answer.endpoint = node.endpoint;
  Result<std::unique_ptr<wire::NodeLink>> link = wire::NodeLink::open({node.endpoint, "", node.keys});
  if (link) {
    probe.link = std::move(*link);
  } else {
    probe.answer.fault = link.error().message;
  }
  return probe;
}

}  // namespace

Duration round_trip(const wire::NodeEcho& echo) {
  return (echo.arrived_at - echo.called_at) - (echo.sent_at - echo.received_at);
}

std::vector<NodeAnswer> probe_nodes(const std::vector<NodeAddress>& nodes, Duration patience) {
  std::vector<Probe> probes;
  for (const NodeAddress& node : nodes) probes.push_back(begin(node));
  const Timestamp end = host_now() + patience;
  Timestamp call_at;
  while (host_now() < end && !std::ranges::all_of(probes, &Probe::done)) {
    const bool call = host_now() >= call_at;
    if (call) call_at = host_now() + kCallEvery;
    for (Probe& probe : probes) {
      if (probe.done()) continue;
      if (call) probe.link->call();
      probe.read();
    }
  }
  std::vector<NodeAnswer> answers;
  for (Probe& probe : probes) {
    NodeAnswer& answer = answers.emplace_back(std::move(probe.answer));
    if (answer.echo || !answer.fault.empty()) continue;
    answer.fault = probe.link->fault();
    if (answer.fault.empty()) answer.fault = "no answer: does mocapd of this version run there, with a section [node]?";
  }
  return answers;
}

}  // namespace mocap::ctl
