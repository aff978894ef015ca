#include "watch/doctor.h"

#include <fmt/core.h>

#include <chrono>
#include <memory>

#include "base/exit_codes.h"
#include "mocap_client.hpp"
#include "watch/feed_state.h"
#include "watch/idle_cameras.h"
#include "wire/zmq_subscriber.h"

namespace mocap::watch {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kFirstCode = 10;
constexpr int kIdleCamera = 40;
constexpr int kNoTimecode = 41;
constexpr int kLook_ms = 100;
constexpr double kWellFor_s = 2.5;  // the clock check needs two seconds
// A connection fault that lasts this long is reported. A wrong server key may become a more
// precise fault with the next attempt of the library, which follows after 0.5 s.
constexpr double kWrongFor_s = 0.8;
constexpr double kVagueFor_s = 1.5;

double seconds_since(Clock::time_point then) { return std::chrono::duration<double>(Clock::now() - then).count(); }

// Faults that the handshake reveals. Waiting longer does not change them.
bool is_final(int code) {
  return code == MOCAP_NOTHING_LISTENS || code == MOCAP_KEY_MISSING || code == MOCAP_KEY_REFUSED ||
         code == MOCAP_SERVER_KEY_WRONG || code == MOCAP_VERSION_TOO_NEW;
}

std::string figures_of(const Client& client, const ClientFrame& frame) {
  const mocap_statistics statistics = client.statistics();
  const mocap_frame_info info = frame.info();
  std::string text = fmt::format(": {:.1f} Hz, cameras {} of {}, lost {}", statistics.rate_hz, info.cameras,
                                 info.expected_cameras, statistics.lost);
  if (statistics.age_p50_ns != MOCAP_ABSENT)
    text += fmt::format(", age {:.1f} ms", static_cast<double>(statistics.age_p50_ns) / 1e6);
  return text;
}

/// Receives the health reports beside the C client, which does not have them.
class HealthReports {
 public:
  explicit HealthReports(const DoctorOptions& options) {
    auto keys = wire::load_client_keys(options.server_key, options.secret_key);
    if (!keys) return;
    auto opened =
        wire::ZmqSubscriber::open({.endpoint = options.endpoint, .topics = {"health"}, .keys = *std::move(keys)});
    if (opened) subscriber_ = *std::move(opened);
  }

  void take() {
    if (!subscriber_) return;
    while (const auto message = subscriber_->next(Duration(0))) feed_.take(*message, host_now());
  }
  const FeedState& feed() const { return feed_; }

 private:
  std::unique_ptr<wire::ZmqSubscriber> subscriber_;  // null: the C client reports why
  FeedState feed_;
};

// Why there is no timecode, or no good one; empty: it is locked, or there is no source of timecode.
std::string no_timecode(const FeedState& feed) {
  if (!feed.health() || feed.health()->timecode.source == TimecodeSourceKind::None) return {};
  return std::string(text_of(feed.health()->timecode.sentence));
}

// The faults beside which an idle camera is the better explanation.
bool receives_data(int code) { return code == MOCAP_WELL || code == MOCAP_SUBJECT_SEARCHING; }

}  // namespace

DoctorWord ask_doctor(const DoctorOptions& options) {
  std::string fault;
  const auto client = Client::open(
      {.endpoint = options.endpoint, .server_key = options.server_key, .secret_key = options.secret_key}, &fault);
  if (!client) return {kExitUsage, fault};
  HealthReports reports(options);
  ClientFrame frame;
  ClientDiagnosis found;
  const Clock::time_point began = Clock::now();
  Clock::time_point since = began;
  while (seconds_since(began) < options.seconds) {
    client->wait(frame, kLook_ms);
    reports.take();
    ClientDiagnosis now = client->diagnose();
    if (now.code != found.code) since = Clock::now();
    found = std::move(now);
    if (found.code == MOCAP_WELL && seconds_since(since) > kWellFor_s) break;
    const double wrong_for_s = found.code == MOCAP_SERVER_KEY_WRONG ? kVagueFor_s : kWrongFor_s;
    if (is_final(found.code) && seconds_since(since) > wrong_for_s) break;
  }
  if (const std::string idle = idle_cameras(reports.feed()); receives_data(found.code) && !idle.empty())
    return {kIdleCamera, fmt::format("{}: {}", options.endpoint, idle)};
  if (const std::string why = no_timecode(reports.feed()); receives_data(found.code) && !why.empty())
    return {kNoTimecode, fmt::format("{}: {}", options.endpoint, why)};
  if (found.code == MOCAP_WELL) return {0, options.endpoint + ": " + found.sentence + figures_of(*client, frame)};
  return {kFirstCode + found.code, found.sentence};
}

}  // namespace mocap::watch
