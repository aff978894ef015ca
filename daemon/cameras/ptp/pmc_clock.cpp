#include "cameras/ptp/pmc_clock.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "base/child_process.h"
#include "cameras/ptp/pmc_answer.h"
#include "cameras/ptp/ptp_fit.h"

namespace mocap::cameras {
namespace {

constexpr Duration kPatience = std::chrono::seconds(1);
// An older offset is stated in another time scale: that of a network card, which has TAI instead of UTC.
constexpr Duration kOldest = std::chrono::seconds(10);

std::string pmc() {
  const std::string installed = "/usr/sbin/pmc";  // $PATH of an ordinary user does not have the folder
  std::error_code ignored;
  return std::filesystem::exists(installed, ignored) ? installed : "pmc";
}

// Where ptp4l sends its answers: a place that both see, so not the /tmp of the service alone.
std::string answer_socket() {
  const char* of_service = std::getenv("RUNTIME_DIRECTORY");  // NOLINT(concurrency-mt-unsafe): nobody sets variables
  std::error_code failed;
  std::filesystem::path folder =
      of_service != nullptr ? std::filesystem::path(of_service) : std::filesystem::temp_directory_path(failed);
  if (failed) folder = "/tmp";  // $TMPDIR names no folder
  return (folder / fmt::format("mocapd-pmc-{}", ::getpid())).string();
}

class PmcClock final : public PtpClock {
 public:
  explicit PmcClock(const PtpSettings& settings)
      : socket_(settings.socket),
        command_{
            pmc(), "-u", "-b", "0", "-i", answer_socket(), "-s", socket_, "GET TIME_STATUS_NP", "GET PORT_DATA_SET"} {}

  Status measure() override {
    if (::access(socket_.c_str(), F_OK) != 0) return Error{ErrorCode::NotFound, "ptp4l does not run: no " + socket_};
    if (::access(socket_.c_str(), W_OK) != 0) {
      return Error{ErrorCode::Io, fmt::format("this user may not write to {}, the socket of ptp4l; give its group to "
                                              "the user (chgrp, in ExecStartPost of ptp4l's unit)",
                                              socket_)};
    }
    const Result<std::string> printed = ChildProcess::output_of(command_, kPatience);
    if (!printed) return printed.error();
    const Result<PmcAnswer> answer = parse_pmc(*printed);
    if (!answer) return Error{answer.error().code, fmt::format("{} ({})", answer.error().message, socket_)};
    add(*answer);
    return {};
  }

  std::optional<PtpLine> line(Timestamp at) const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return fit_.line(at);
  }

 private:
  void add(const PmcAnswer& answer) {
    const Duration utc_minus_host = mocap::utc_minus_host();
    const Timestamp now = host_now();
    Timestamp at = answer.measured ? Timestamp(*answer.measured - utc_minus_host) : now;
    if (at > now || now - at > kOldest) at = now;
    const std::lock_guard<std::mutex> lock(mutex_);
    fit_.add(answer.grandmaster, at, at.time_since_epoch() + utc_minus_host - answer.offset);
  }

  std::string socket_;
  std::vector<std::string> command_;
  mutable std::mutex mutex_;  // guards fit_
  PtpFit fit_;
};

}  // namespace

std::unique_ptr<PtpClock> make_pmc_clock(const PtpSettings& settings) { return std::make_unique<PmcClock>(settings); }

}  // namespace mocap::cameras
