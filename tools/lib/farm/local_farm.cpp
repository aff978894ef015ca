#include "lib/farm/local_farm.h"

#include <fmt/format.h>
#include <poll.h>
#include <sched.h>

#include <algorithm>
#include <csignal>
#include <deque>
#include <list>
#include <optional>

#include "base/exit_codes.h"
#include "base/time.h"
#include "lib/retrack/part_file.h"

namespace mocap::farm {
namespace {

constexpr int kLook_ms = 200;
constexpr int kAttempts = 2;
// A worker looks at its signals once in 100 sets, and the backward pass of --preset offline is the slowest.
constexpr Duration kPatience = std::chrono::seconds(20);

class LocalFarm {
 public:
  LocalFarm(const std::vector<Unit>& units, const UnitCommand& common, std::size_t jobs, const FarmWatch& watch)
      : common_(common), jobs_(jobs), watch_(watch) {
    for (const Unit& unit : units) waiting_.push_back({&unit});
    progress_.units = units.size();
    for (const Unit& unit : units) all_bytes_ += weight(unit);
  }

  std::size_t run() {
    for (;;) {
      begin_waiting();
      if (running_.empty()) return waiting_.size();
      await_output();
      if (watch_.stops() > 0) stop();
      tell_progress();
    }
  }

 private:
  struct Job {
    const Unit* unit;
    int attempt = 0;
    std::optional<ChildProcess> process = {};
    UnitOutput output = {};
  };

  static double weight(const Unit& unit) { return static_cast<double>(std::max<std::uint64_t>(unit.bytes, 1)); }

  void begin_waiting() {
    while (watch_.stops() == 0 && running_.size() < jobs_ && !waiting_.empty()) {
      Job job = std::move(waiting_.front());
      waiting_.pop_front();
      std::vector<std::string> command = command_of(common_, *job.unit);
      command.emplace_back("--progress");
      auto process = ChildProcess::start(command);
      if (!process) {
        tell_end(job, {UnitResult::Kind::Failed, kExitUnavailable, process.error().message, {}});
        continue;
      }
      ++job.attempt;
      job.process.emplace(*std::move(process));
      job.output = {};
      running_.push_back(std::move(job));
    }
  }

  void await_output() {
    std::vector<pollfd> ready;
    for (const Job& job : running_) ready.push_back({job.process->descriptor(), POLLIN, 0});
    if (::poll(ready.data(), ready.size(), kLook_ms) <= 0) return;
    auto job = running_.begin();
    for (const pollfd& one : ready) {
      const auto current = job++;
      if (one.revents != 0 && !read(*current)) {
        end(*current);
        running_.erase(current);
      }
    }
  }

  static bool read(Job& job) {
    const auto lines = job.process->read();
    if (!lines) return false;
    for (const std::string& line : *lines) job.output.add(line);
    return true;
  }

  void end(Job& job) {
    const ProcessEnd ended = job.process->wait();
    job.process.reset();
    if (ended.signal != 0) (void)retrack::remove_part_of(file_of(*job.unit));
    if (ended.well() || watch_.stops() == 0) {
      if (ended.signal != 0 && job.attempt < kAttempts) {
        waiting_.push_front(std::move(job));
        return;
      }
      return tell_end(job, result_of(job, ended));
    }
    tell_end(job, {UnitResult::Kind::Stopped, kExitUnavailable, "was stopped", {}});
  }

  static UnitResult result_of(const Job& job, const ProcessEnd& ended) {
    UnitResult result = job.output.result(ended);
    if (ended.signal != 0)
      result.reason += fmt::format(", {} times; if memory is short, use fewer --jobs", job.attempt);
    return result;
  }

  void tell_end(const Job& job, const UnitResult& result) {
    ++progress_.ended;
    if (result.kind == UnitResult::Kind::Failed) ++progress_.failed;
    ended_bytes_ += weight(*job.unit);
    watch_.ended(*job.unit, result);
  }

  void stop() {
    if (!stopped_) {
      stopped_ = host_now();
      for (const Job& job : running_) job.process->send(SIGTERM);
    }
    if (watch_.stops() < 2 && host_now() - *stopped_ < kPatience) return;
    for (const Job& job : running_) job.process->send(SIGKILL);
  }

  void tell_progress() {
    double bytes = ended_bytes_;
    for (const Job& job : running_) bytes += job.output.share() * weight(*job.unit);
    progress_.share = std::min(bytes / all_bytes_, 1.0);
    watch_.progress(progress_);
  }

  const UnitCommand& common_;
  std::size_t jobs_;
  const FarmWatch& watch_;
  std::deque<Job> waiting_;
  std::list<Job> running_;
  FarmProgress progress_;
  double all_bytes_ = 0.0, ended_bytes_ = 0.0;
  std::optional<Timestamp> stopped_;
};

}  // namespace

std::size_t run_here(const std::vector<Unit>& units, const UnitCommand& common, int jobs, const FarmWatch& watch) {
  return LocalFarm(units, common, static_cast<std::size_t>(std::max(jobs, 1)), watch).run();
}

int usable_processors() {
  cpu_set_t usable;
  CPU_ZERO(&usable);
  if (::sched_getaffinity(0, sizeof(usable), &usable) != 0) return 1;
  return std::max(CPU_COUNT(&usable), 1);
}

}  // namespace mocap::farm
