#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "wire/role.h"

namespace mocap::wire {

/// [security]: authentication of clients by CURVE keys. Help: the table in wire_settings.cpp.
struct CurveSettings {
  std::filesystem::path server_key;  ///< empty: clients are not authenticated
  std::filesystem::path allowed;

  bool on() const { return !server_key.empty(); }
};

/// [publish]: the feed. Help, units and ranges: the table in wire_settings.cpp.
struct PublisherSettings {
  std::string endpoint = "tcp://127.0.0.1:5570";
  std::vector<std::string> more_endpoints = {};
  bool allow_remote = false;
  CurveSettings curve = {};
  bool velocities = false;
  double lite_hz = 30.0;
  std::size_t subjects = 1;  ///< number of subjects, each with a topic of its own; not a key of the file
  int send_queue = 8;
  int max_connections = 1000;
};

/// [control]: requests of operators. Help: the table in wire_settings.cpp.
struct ControlSettings {
  std::string endpoint;  ///< empty: next to the feed's endpoint; "none": no control socket
  std::vector<std::string> more_endpoints = {};
  bool allow_remote = false;
  CurveSettings curve = {};
  Role role_without_keys = Role::Operator;
};

/// [node]: this daemon sends the blobs of its cameras to a fusion host. Help: the table in wire_settings.cpp.
struct NodeSettings {
  std::string name;      ///< empty: the host name
  std::string endpoint;  ///< empty: this daemon is no node
  std::vector<std::string> more_endpoints = {};
  bool allow_remote = false;
  CurveSettings curve = {};
  int send_queue = 32;
  bool announce = true;  ///< by DNS-SD, if other machines can connect

  bool on() const { return !endpoint.empty(); }
};

void declare_keys(KeyVisitor& keys, CurveSettings& curve);
void declare_keys(KeyVisitor& keys, PublisherSettings& feed);
void declare_keys(KeyVisitor& keys, ControlSettings& control);
void declare_keys(KeyVisitor& keys, NodeSettings& node);

/// Returns the faults that concern several keys.
std::vector<KeyFault> faults_of(const CurveSettings& curve);
/// The member `curve` must be a copy of [security].
std::vector<KeyFault> faults_of(const PublisherSettings& feed);
std::vector<KeyFault> faults_of(const ControlSettings& control);
std::vector<KeyFault> faults_of(const NodeSettings& node);

}  // namespace mocap::wire
