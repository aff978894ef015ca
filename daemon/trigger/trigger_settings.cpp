#include "trigger/trigger_settings.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "trigger/ip4.h"

namespace mocap::trigger {
namespace {

constexpr KeyRange kPorts{1, 65535};
constexpr KeyRange kAnswerPorts{0, 65535};

void add_to(std::vector<SocketUse>& sockets, Protocol protocol, const std::vector<int>& ports) {
  for (const int port : ports) sockets.push_back({protocol, port});
}

// The key of the first port that an earlier one repeats.
std::optional<KeyFault> repeated_port(const TriggerSettings& trigger) {
  std::vector<int> seen;
  const std::pair<const char*, const std::vector<int>*> lists[] = {
      {"xml_ports", &trigger.xml_ports}, {"xsens_ports", &trigger.xsens_ports}, {"osc_ports", &trigger.osc_ports}};
  for (const auto& [key, ports] : lists) {
    for (const int port : *ports) {
      if (std::ranges::find(seen, port) != seen.end()) {
        return KeyFault{key, fmt::format("{} has {}, which is there twice, expected a different port each", key, port)};
      }
      seen.push_back(port);
    }
  }
  return std::nullopt;
}

}  // namespace

void declare_keys(KeyVisitor& keys, TriggerSettings& trigger) {
  keys.text("listen", trigger.listen,
            {.help = "IPv4 address of this machine that senders reach, \"0.0.0.0\": every one; \"none\": nobody else "
                     "starts takes"});
  keys.texts("senders", trigger.senders,
             {.help = "IPv4 addresses of the machines that may start and stop takes, such as [\"192.168.1.20\"]; UDP "
                      "has no password"});
  keys.whole_numbers("xml_ports", trigger.xml_ports, kPorts,
                     {.help = "CaptureStart and CaptureStop, as Vicon (30), Motive (1512), Qualisys (8989), Rokoko and "
                              "stage controllers send them"});
  keys.whole_numbers("xsens_ports", trigger.xsens_ports, kPorts,
                     {.help = "StartRecordingReq and StopRecordingReq of Xsens (6004)"});
  keys.whole_numbers("osc_ports", trigger.osc_ports, kPorts,
                     {.help = "OSC /RecordStart and /RecordStop, as Switchboard of Unreal sends them (8000)"});
  keys.number("xml_answer_port", trigger.xml_answer_port, kAnswerPorts,
              {.help = "UDP port of the sender to which answers go; 0: the port that the packet came from"});
  keys.number("osc_answer_port", trigger.osc_answer_port, kAnswerPorts,
              {.help = "UDP port of the sender to which confirmations go; 0: the port that the packet came from"});
  keys.texts("xml_receivers", trigger.xml_receivers,
             {.help = "ADDRESS:PORT of programs that record with this daemon: they receive CaptureStart, CaptureStop "
                      "and CaptureComplete of every take"});
  keys.texts("osc_receivers", trigger.osc_receivers,
             {.help = "ADDRESS:PORT of programs that receive /RecordStart and /RecordStop of every take"});
}

std::vector<KeyFault> faults_of(const TriggerSettings& trigger) {
  std::vector<KeyFault> faults;
  if (trigger.listens() && !read_address(trigger.listen)) {
    faults.push_back({"listen", fmt::format("listen is '{}', expected an IPv4 address of this machine, \"0.0.0.0\" or "
                                            "\"none\"",
                                            trigger.listen)});
  }
  if (trigger.listens() && trigger.senders.empty()) {
    faults.push_back({"senders",
                      "senders is empty, expected the IPv4 addresses of the machines that may start and stop takes, "
                      "or listen = \"none\": without the list everybody on the network could"});
  }
  for (const std::string& sender : trigger.senders) {
    if (read_address(sender)) continue;
    faults.push_back(
        {"senders", fmt::format("senders has '{}', expected IPv4 addresses such as 192.168.1.20", sender)});
  }
  if (trigger.listens() && trigger.xml_ports.empty() && trigger.xsens_ports.empty() && trigger.osc_ports.empty()) {
    faults.push_back({"listen",
                      "listen is set, but no port; expected at least one in xml_ports, xsens_ports or "
                      "osc_ports"});
  }
  if (const std::optional<KeyFault> repeated = repeated_port(trigger)) faults.push_back(*repeated);
  const auto check_receivers = [&](const char* key, const std::vector<std::string>& receivers) {
    for (const std::string& receiver : receivers) {
      if (read_peer(receiver)) continue;
      faults.push_back(
          {key, fmt::format("{} has '{}', expected ADDRESS:PORT such as 192.168.1.30:8989", key, receiver)});
    }
  };
  check_receivers("xml_receivers", trigger.xml_receivers);
  check_receivers("osc_receivers", trigger.osc_receivers);
  return faults;
}

std::vector<SocketUse> sockets_of(const TriggerSettings& trigger) {
  std::vector<SocketUse> sockets;
  if (trigger.listens()) {
    add_to(sockets, Protocol::Xml, trigger.xml_ports);
    add_to(sockets, Protocol::Xsens, trigger.xsens_ports);
    add_to(sockets, Protocol::Osc, trigger.osc_ports);
  }
  if (trigger.has_receivers()) sockets.push_back({Protocol::Answers, 0});
  return sockets;
}

}  // namespace mocap::trigger
