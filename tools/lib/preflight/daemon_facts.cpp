#include "lib/preflight/daemon_facts.h"

#include <algorithm>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

namespace mocap::preflight {
namespace {

constexpr Duration kAnswerWithin = std::chrono::seconds(5);
constexpr Duration kCheck = std::chrono::milliseconds(2200);  // two reports of health
// A take of eight cameras at 120 Hz with 40 blobs each, before compression; the estimate until a take was recorded.
constexpr double kUsualTake_bytes_s = 4e6;

Result<v1::Answer> ask(wire::ControlClient& client, const v1::Request& request) {
  const Result<std::string> came = client.ask(request.SerializeAsString(), kAnswerWithin);
  if (!came) return came.error();
  v1::Answer answer;
  if (!answer.ParseFromString(*came)) return Error{ErrorCode::InvalidArgument, "the answer is not a mocap.v1 message"};
  if (answer.code() != v1::CODE_DONE) return Error{ErrorCode::Io, answer.message()};
  return answer;
}

Result<v1::Status> ask_status(wire::ControlClient& client) {
  v1::Request request;
  request.set_id(1);
  request.mutable_status();
  Result<v1::Answer> answer = ask(client, request);
  if (!answer) return answer.error();
  return std::move(*answer->mutable_status());
}

double take_rate_bytes_s(const v1::TakeHealth& take) {
  constexpr double kLongEnough_s = 5.0;
  if (take.seconds() < kLongEnough_s) return kUsualTake_bytes_s;
  return std::max(1.0, static_cast<double>(take.size_bytes()) / take.seconds());
}

}  // namespace

Result<PreflightFacts> ask_daemon(wire::ControlClient& client) {
  PreflightFacts facts;
  v1::Request request;
  request.set_id(1);
  request.mutable_description();
  Result<v1::Answer> described = ask(client, request);
  if (!described) return described.error();
  facts.description = std::move(*described->mutable_description());
  Result<v1::Status> before = ask_status(client);
  if (!before) return before.error();
  facts.before = *std::move(before);
  std::this_thread::sleep_for(kCheck);
  Result<v1::Status> now = ask_status(client);
  if (!now) return now.error();
  facts.now = *std::move(now);
  return facts;
}

void look_at_files(const std::filesystem::path& takes, const std::filesystem::path& rig_file, PreflightFacts& facts) {
  std::error_code error;
  const auto space = std::filesystem::space(std::filesystem::exists(takes, error) ? takes : takes.parent_path(), error);
  if (!error)
    facts.free_minutes = static_cast<double>(space.available) / take_rate_bytes_s(facts.now.health().take()) / 60.0;
  const auto written = std::filesystem::last_write_time(rig_file, error);
  if (!error) {
    const auto age = std::filesystem::file_time_type::clock::now() - written;
    facts.calibration_age_days = std::chrono::duration<double>(age).count() / 86400.0;
  }
}

Finding silent_daemon(const Error& error) { return bad("daemon", error.message, "systemctl status mocapd"); }

}  // namespace mocap::preflight
