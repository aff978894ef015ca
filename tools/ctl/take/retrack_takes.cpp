#include "ctl/take/retrack_takes.h"

#include <fmt/format.h>

#include <cstdio>
#include <functional>
#include <optional>
#include <set>
#include <utility>

#include "base/exit_codes.h"
#include "base/time.h"
#include "ctl/json_line.h"
#include "ctl/take/join_command.h"
#include "ctl/take/stop_signals.h"
#include "lib/cli/status_line.h"
#include "lib/farm/local_farm.h"
#include "lib/farm/openjd.h"
#include "lib/farm/submission.h"
#include "lib/farm/submitted.h"

namespace mocap::ctl {
namespace {

using farm::FarmProgress;
using farm::UnitResult;

// A number of a report, whose format is that of this program's own --json.
double number_of(const nlohmann::ordered_json& report, const char* key) {
  const auto found = report.find(key);
  return found != report.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string text_of(const nlohmann::ordered_json& report, const char* key, const std::string& otherwise) {
  const auto found = report.find(key);
  return found != report.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

// Prints one line for each unit that ended, and counts them.
class UnitLines {
 public:
  UnitLines(bool json, cli::StatusLine& status) : json_(json), status_(status) {}

  void print(const farm::Unit& unit, const UnitResult& result) {
    status_.clear();
    if (result.kind == UnitResult::Kind::Failed && exit_code_ == kExitOk) exit_code_ = result.exit_code;
    if (result.kind == UnitResult::Kind::Failed) incomplete_.insert(unit.out);
    ++counts_[static_cast<std::size_t>(result.kind)];
    json_ ? print_json(unit, result) : print_text(unit, result);
    std::fflush(stdout);
  }

  void print_sum(std::size_t not_begun) const {
    if (json_) return;
    std::string sum = fmt::format("{} tracked", count(UnitResult::Kind::Tracked));
    const auto add = [&](std::size_t number, const char* what) {
      if (number > 0) sum += fmt::format(", {} {}", number, what);
    };
    add(count(UnitResult::Kind::Kept), "there already");
    add(count(UnitResult::Kind::Failed), "failed");
    add(count(UnitResult::Kind::Stopped), "stopped");
    add(not_begun, "not begun");
    fmt::print("{}\n", sum);
  }

  int exit_code() const noexcept { return exit_code_; }
  // The new takes of which a unit failed.
  const std::set<std::filesystem::path>& incomplete() const noexcept { return incomplete_; }

 private:
  std::size_t count(UnitResult::Kind kind) const { return counts_[static_cast<std::size_t>(kind)]; }

  static void print_json(const farm::Unit& unit, const UnitResult& result) {
    nlohmann::ordered_json json{{"take", unit.take.string()}};
    if (unit.chunk) json["chunk"] = to_text(*unit.chunk);
    if (result.report.is_object()) json.update(result.report);
    if (!result.reason.empty()) {
      json["error"] = result.reason;
      json["exit_code"] = result.exit_code;
    }
    fmt::print("{}\n", json_line(json));
  }

  static void print_text(const farm::Unit& unit, const UnitResult& result) {
    switch (result.kind) {
      case UnitResult::Kind::Tracked:
        fmt::print("{}: {:.0f} sets, {:.1f} times as fast as they were recorded", farm::file_of(unit).string(),
                   number_of(result.report, "sets"), number_of(result.report, "speed"));
        if (!unit.chunk) {
          fmt::print("; {:.0f} of {:.0f} snapshots are those of the recording", number_of(result.report, "equal_sets"),
                     number_of(result.report, "recorded_sets"));
        }
        fmt::print("\n");
        return;
      case UnitResult::Kind::Kept:
        fmt::print("{}: is there, made of the same take and settings by this version; not tracked again\n",
                   text_of(result.report, "file", farm::file_of(unit).string()));
        return;
      case UnitResult::Kind::Failed:
      case UnitResult::Kind::Stopped:
        fmt::print(stderr, "mocapctl: {}{}: {}\n", unit.take.string(),
                   unit.chunk ? fmt::format(", chunk {}", to_text(*unit.chunk)) : "", result.reason);
    }
  }

  bool json_;
  cli::StatusLine& status_;
  std::size_t counts_[4] = {};  // by kind
  int exit_code_ = kExitOk;
  std::set<std::filesystem::path> incomplete_;
};

// Joins the chunks of each take whose chunks are all there. Returns the exit code of the first failure.
int join_takes(const RetrackTakes& order, const std::vector<farm::Unit>& units, const UnitLines& lines) {
  int code = lines.exit_code();
  for (const farm::Unit& unit : units) {
    if (!unit.chunk || unit.chunk->number != 1) continue;
    if (lines.incomplete().contains(unit.out)) {
      fmt::print(stderr, "mocapctl: {}: not joined, as a chunk failed; the same command with --resume goes on\n",
                 unit.out.string());
      continue;
    }
    const int ended = join_chunks(
        {.out = unit.out, .count = order.chunks, .remove_chunks = true, .resume = true, .json = order.json});
    if (code == kExitOk) code = ended;
  }
  return code;
}

std::string line_of(const FarmProgress& progress, const char* units, double spent_s) {
  std::string line = fmt::format("mocapctl: tracked {:.0f} %, {} of {} {} done", 100.0 * progress.share, progress.ended,
                                 progress.units, units);
  if (progress.failed > 0) line += fmt::format(", {} failed", progress.failed);
  if (progress.share > 0.0) line += fmt::format(", {:.0f} s left", spent_s / progress.share - spent_s);
  return line;
}

std::filesystem::path this_program() {
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error);
}

int refuse(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", error.message);
  switch (error.code) {
    case ErrorCode::InvalidArgument: return kExitUsage;
    case ErrorCode::NotFound: return kExitUnavailable;
    default: return kExitCannotWrite;
  }
}

farm::FarmOrder farm_order(const RetrackTakes& order, std::vector<farm::Unit> units) {
  farm::FarmOrder farm;
  farm.units = std::move(units);
  farm.common = {this_program(), order.options};
  // A machine may fail after the new take was whole, and the unit is then run again.
  if (!order.resume) farm.common.options.emplace_back("--resume");
  farm.folder = std::filesystem::absolute(order.out_dir).lexically_normal() / "farm";
  farm.jobs = order.jobs;
  farm.resume = order.resume;
  return farm;
}

int write_job_template(const farm::FarmOrder& order) {
  const auto path = farm::write_openjd(order);
  if (!path) return refuse(path.error());
  fmt::print(
      "{}: the job template; submit it with the program of the render manager, or run it here with\n"
      "  openjd run {}{}\n",
      path->string(), farm::shell_word(path->string()),
      order.units.front().chunk ? " --step join --run-dependencies" : " --step retrack");
  return kExitOk;
}

// Runs the units, on this machine or by a farm. Returns how many were left when the user stopped it.
using RunUnits = std::function<Result<std::size_t>(const farm::FarmWatch&)>;

int watch_units(const RetrackTakes& order, const std::vector<farm::Unit>& units, const RunUnits& run) {
  std::optional<StopSignals> stops(std::in_place);
  cli::StatusLine status;
  UnitLines lines(order.json, status);
  const Timestamp started = host_now();
  farm::FarmWatch watch;
  watch.progress = [&](const FarmProgress& now) {
    if (order.progress) return fmt::print(stderr, "progress {:.4f}\n", now.share);
    status.show(line_of(now, order.chunks > 0 ? "chunks" : "takes", to_s(host_now() - started)));
  };
  watch.ended = [&](const farm::Unit& unit, const UnitResult& result) { lines.print(unit, result); };
  watch.stops = [&] { return stops->count(); };
  const Result<std::size_t> left = run(watch);
  status.clear();
  if (!left) return refuse(left.error());
  lines.print_sum(*left);
  if (stops->count() > 0) fmt::print(stderr, "mocapctl: the same command with --resume goes on\n");
  std::fflush(stdout);
  stops->end_program();
  stops.reset();
  return join_takes(order, units, lines);
}

int run_farm(const RetrackTakes& order, const farm::FarmOrder& farm) {
  const auto submission = order.farm == "slurm" ? farm::write_slurm(farm) : farm::write_parallel(farm);
  if (!submission) return refuse(submission.error());
  if (order.dry_run) {
    for (const auto& file : submission->files) fmt::print("{}: written\n", file.string());
    fmt::print("the takes are tracked by\n  {}\n", farm::shell_words(submission->command));
    return kExitOk;
  }
  return watch_units(order, farm.units,
                     [&](const farm::FarmWatch& watch) { return farm::run_submitted(farm, *submission, watch); });
}

}  // namespace

int retrack_takes(const RetrackTakes& order) {
  auto units = farm::make_units(order.takes, order.out_dir);
  if (!units) return refuse(units.error());
  if (!order.out.empty()) units->front().out = std::filesystem::absolute(order.out).lexically_normal();
  if (order.chunks > 0) units = farm::in_chunks(*units, order.chunks);
  if (!order.farm.empty()) {
    const farm::FarmOrder farm = farm_order(order, *std::move(units));
    return order.farm == "openjd" ? write_job_template(farm) : run_farm(order, farm);
  }
  const int jobs = order.jobs > 0 ? order.jobs : farm::usable_processors();
  return watch_units(order, *units, [&](const farm::FarmWatch& watch) -> Result<std::size_t> {
    return farm::run_here(*units, {this_program(), order.options}, jobs, watch);
  });
}

}  // namespace mocap::ctl
