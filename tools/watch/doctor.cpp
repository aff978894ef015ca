#include "watch/doctor.h"

#include <fmt/core.h>

#include <chrono>

#include "mocap_client.hpp"

namespace mocap::watch {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kUsage = 64;
constexpr int kFirstCode = 10;
constexpr int kLook_ms = 100;
constexpr double kWellFor_s = 2.5;   // clocks are judged over two seconds
constexpr double kWrongFor_s = 1.5;  // a fault of the connection that stays that long is one

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

// These are told by the handshake and do not become better by looking longer.
bool is_final(int code) {
  return code == MOCAP_NOTHING_LISTENS || code == MOCAP_KEY_MISSING || code == MOCAP_KEY_REFUSED ||
         code == MOCAP_SERVER_KEY_WRONG || code == MOCAP_VERSION_TOO_NEW;
}

std::string figures_of(const Client& client, const ClientFrame& frame) {
  const mocap_statistics statistics = client.statistics();
  const mocap_frame_info info = frame.info();
  std::string said = fmt::format(": {:.1f} Hz, cameras {} of {}, lost {}", statistics.rate_hz, info.cameras,
                                 info.expected_cameras, statistics.lost);
  if (statistics.age_p50_ns != MOCAP_ABSENT)
    said += fmt::format(", age {:.1f} ms", static_cast<double>(statistics.age_p50_ns) / 1e6);
  return said;
}

}  // namespace

DoctorWord ask_doctor(const DoctorOptions& options) {
  std::string fault;
  const auto client =
      Client::open({.endpoint = options.endpoint, .server_key = options.server_key, .secret_key = options.key}, &fault);
  if (!client) return {kUsage, fault};
  ClientFrame frame;
  ClientDiagnosis found;
  const Clock::time_point began = Clock::now();
  Clock::time_point since = began;
  while (seconds_since(began) < options.seconds) {
    client->wait(frame, kLook_ms);
    ClientDiagnosis now = client->diagnose();
    if (now.code != found.code) since = Clock::now();
    found = std::move(now);
    if (found.code == MOCAP_WELL && seconds_since(since) > kWellFor_s) break;
    if (is_final(found.code) && seconds_since(since) > kWrongFor_s) break;
  }
  if (found.code == MOCAP_WELL) return {0, options.endpoint + ": " + found.sentence + figures_of(*client, frame)};
  return {kFirstCode + found.code, found.sentence};
}

}  // namespace mocap::watch
