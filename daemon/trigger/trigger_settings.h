#pragma once

#include <string>
#include <vector>

#include "base/key_visitor.h"

namespace mocap::trigger {

/// [trigger]: takes that other programs start and stop over UDP. Help: the table in trigger_settings.cpp.
struct TriggerSettings {
  std::string listen = "none";
  std::vector<std::string> senders = {};
  std::vector<int> xml_ports = {8989};
  std::vector<int> xsens_ports = {};
  std::vector<int> osc_ports = {};
  int xml_answer_port = 0;
  int osc_answer_port = 0;
  std::vector<std::string> xml_receivers = {};
  std::vector<std::string> osc_receivers = {};

  bool listens() const { return listen != "none"; }
  bool has_receivers() const { return !xml_receivers.empty() || !osc_receivers.empty(); }
};

void declare_keys(KeyVisitor& keys, TriggerSettings& trigger);

/// Returns the faults of addresses, ports and the list of senders.
std::vector<KeyFault> faults_of(const TriggerSettings& trigger);

/// The packets that a socket receives.
enum class Protocol {
  Xml,     ///< CaptureStart and its answers, as Vicon and others have them
  Xsens,   ///< the same and StartRecordingReq, with the answers of Xsens
  Osc,     ///< /RecordStart and its confirmation
  Answers  ///< of receivers of our own packets, no orders
};

struct SocketUse {
  Protocol protocol = Protocol::Xml;
  int port = 0;  ///< 0: any
};

/// The sockets of the settings, in the order of their indices. Own packets go out by the last one, if there are
/// receivers.
std::vector<SocketUse> sockets_of(const TriggerSettings& trigger);

}  // namespace mocap::trigger
