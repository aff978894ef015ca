#include "lib/farm/submitted.h"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <string>
#include <system_error>

#include "base/exit_codes.h"

namespace mocap::farm {
namespace {

namespace fs = std::filesystem;

constexpr int kLook_ms = 500;
constexpr std::size_t kMaxWords_bytes = 4096;

UnitResult result_in(const fs::path& log, int exit_code) {
  UnitOutput output;
  std::ifstream file(log);
  for (std::string line; std::getline(file, line);) output.add(line);
  UnitResult result = output.result({.exit_code = exit_code});
  if (result.kind == UnitResult::Kind::Failed) result.reason += fmt::format(" (log: {})", log.string());
  return result;
}

class Submitted {
 public:
  Submitted(const FarmOrder& order, const Submission& submission, const FarmWatch& watch)
      : order_(order), submission_(submission), watch_(watch), has_ended_(order.units.size(), false) {
    progress_.units = order.units.size();
  }

  Result<std::size_t> run() {
    forget_earlier_run();
    Result<ChildProcess> process = ChildProcess::start(submission_.command);
    if (!process) {
      if (process.error().code != ErrorCode::NotFound) return process.error();
      return Error{ErrorCode::NotFound, fmt::format("'{}' is not installed; install the Debian package {}",
                                                    submission_.command.front(), submission_.package)};
    }
    while (listen(*process)) {
      look();
      obey_stops(*process);
    }
    obey_stops(*process);  // a Ctrl-C of the terminal also ends the command, which may be heard of first
    const ProcessEnd ended = process->wait();
    look();
    if (!ended.well() && progress_.ended == 0 && stops_ == 0) {
      return Error{ErrorCode::Io, fmt::format("{}: {}", submission_.command.front(),
                                              words_.empty() ? "ended without a reason" : words_)};
    }
    return end_of_others();
  }

 private:
  void forget_earlier_run() const {
    for (std::size_t i = 0; i < order_.units.size(); ++i) {
      std::error_code ignored;
      if (submission_.goes_on && exit_code_of(order_, i) == 0) continue;
      fs::remove(exit_file_of(order_, i), ignored);
    }
  }

  // False: the command has ended.
  bool listen(ChildProcess& process) {
    pollfd ready{process.descriptor(), POLLIN, 0};
    if (::poll(&ready, 1, kLook_ms) <= 0) return true;
    const auto lines = process.read();
    if (!lines) return false;
    for (const std::string& line : *lines) {
      if (constexpr std::string_view kSubmitted = "Submitted batch job "; line.starts_with(kSubmitted)) {
        job_ = line.substr(kSubmitted.size());
      } else if (words_.size() < kMaxWords_bytes) {
        words_ += words_.empty() ? line : "\n" + line;
      }
    }
    return true;
  }

  void look() {
    for (std::size_t i = 0; i < has_ended_.size(); ++i) {
      if (has_ended_[i]) continue;
      if (const auto code = exit_code_of(order_, i)) tell_end(i, result_in(log_of(order_, i), *code));
    }
    progress_.share = static_cast<double>(progress_.ended) / static_cast<double>(progress_.units);
    watch_.progress(progress_);
  }

  void tell_end(std::size_t unit, const UnitResult& result) {
    has_ended_[unit] = true;
    ++progress_.ended;
    if (result.kind == UnitResult::Kind::Failed) ++progress_.failed;
    watch_.ended(order_.units[unit], result);
  }

  void obey_stops(const ChildProcess& process) {
    if (watch_.stops() <= stops_) return;
    stops_ = watch_.stops();
    if (!submission_.cancels_jobs) {
      // The first SIGTERM keeps GNU parallel from beginning jobs, the second one ends those that run.
      process.send(SIGTERM);
      process.send(SIGTERM);
      return;
    }
    if (!job_.empty()) {
      if (auto cancel = ChildProcess::start({"scancel", job_})) (void)cancel->wait();
    }
    process.send(SIGTERM);
  }

  std::size_t end_of_others() {
    std::size_t left = 0;
    for (std::size_t i = 0; i < has_ended_.size(); ++i) {
      if (has_ended_[i]) continue;
      ++left;
      if (stops_ > 0) continue;
      const std::string job = job_.empty() ? "" : fmt::format(" of job {}", job_);
      tell_end(i, {UnitResult::Kind::Failed,
                   kExitUnavailable,
                   fmt::format("element {}{} did not end: its machine failed, or it was cancelled (log: {})", i, job,
                               log_of(order_, i).string()),
                   {}});
    }
    return stops_ > 0 ? left : 0;
  }

  const FarmOrder& order_;
  const Submission& submission_;
  const FarmWatch& watch_;
  std::vector<bool> has_ended_;
  FarmProgress progress_;
  std::string job_;    // number that Slurm gave
  std::string words_;  // of the command
  int stops_ = 0;      // that were obeyed
};

}  // namespace

Result<std::size_t> run_submitted(const FarmOrder& order, const Submission& submission, const FarmWatch& watch) {
  return Submitted(order, submission, watch).run();
}

}  // namespace mocap::farm
