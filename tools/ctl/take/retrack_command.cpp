#include "ctl/take/retrack_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "base/time.h"
#include "lib/cli/status_line.h"
#include "lib/retrack/retrack.h"

namespace mocap::ctl {
namespace {

using retrack::RetrackOrder;
using retrack::RetrackProgress;
using retrack::RetrackReport;

struct RetrackCommandLine {
  RetrackOrder order;
  std::vector<double> range_s;  // none, or both ends
  std::string preset = "live";
  bool json = false;
};

// Share, speed and the time that is left.
std::string progress_line(const RetrackProgress& progress, double spent_s) {
  return fmt::format("mocapctl: tracked {:.0f} %, {:.0f} sets/s, {:.0f} s left", 100.0 * progress.share,
                     static_cast<double>(progress.sets) / spent_s, spent_s / progress.share - spent_s);
}

int report_failure(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", error.message);
  switch (error.code) {
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::Io: return kExitCannotWrite;
    default: return kExitData;
  }
}

void print_json(const RetrackReport& report, double spent_s) {
  nlohmann::ordered_json json{{"file", report.path},
                              {"sets", report.sets},
                              {"seconds", report.seconds},
                              {"speed", report.seconds / spent_s},
                              {"recorded_sets", report.recorded},
                              {"equal_sets", report.equal},
                              {"missing_views", report.missing_views},
                              {"damaged", report.damaged},
                              {"from_start_of_run", report.from_start_of_run}};
  json["first_difference"] = nullptr;
  if (report.first_difference) json["first_difference"] = *report.first_difference;
  fmt::print("{}\n", json.dump());
}

void print_text(const RetrackReport& report, double spent_s) {
  fmt::print("{}: {} sets in {:.2f} s, {:.1f} times as fast as they were recorded\n", report.path, report.sets, spent_s,
             report.seconds / spent_s);
  if (report.recorded > 0) {
    fmt::print("{} of {} snapshots are those of the recording, byte for byte\n", report.equal, report.recorded);
  }
  if (report.first_difference) {
    fmt::print("set {} is the first that differs{}\n", *report.first_difference,
               report.from_start_of_run ? "" : ": the recording began while the daemon was tracking already");
  }
  if (report.missing_views > 0) fmt::print("{} images that the daemon had are not in the take\n", report.missing_views);
  if (report.damaged > 0) fmt::print("{} damaged messages were left out\n", report.damaged);
}

int run(const RetrackCommandLine& line) {
  RetrackOrder order = line.order;
  if (order.out.empty()) order.out = order.take.stem().string() + "-retracked.mcap";
  if (!line.range_s.empty()) {
    if (!(line.range_s[0] >= 0.0 && line.range_s[1] > line.range_s[0] && line.range_s[1] < 1e6)) {
      fmt::print(stderr, "mocapctl: --range is {} {}, expected two times in s, from 0 on, the first one the smaller\n",
                 line.range_s[0], line.range_s[1]);
      return kExitUsage;
    }
    order.from = from_s(line.range_s[0]);
    order.to = from_s(line.range_s[1]);
  }
  order.offline = line.preset == "offline";
  set_log_level(LogLevel::Warn);
  const Timestamp started = host_now();
  const Result<RetrackReport> report = [&] {
    cli::StatusLine progress;
    return retrack::retrack(order, [&](const RetrackProgress& now) {
      if (now.share > 0.0) progress.show(progress_line(now, to_s(host_now() - started)));
    });
  }();
  if (!report) return report_failure(report.error());
  const double spent_s = std::max(to_s(host_now() - started), 1e-6);
  line.json ? print_json(*report, spent_s) : print_text(*report, spent_s);
  return kExitOk;
}

}  // namespace

void add_retrack_command(cli::App& take, std::function<int()>& chosen) {
  const auto line = std::make_shared<RetrackCommandLine>();
  RetrackOrder& order = line->order;
  cli::App* command =
      take.add_subcommand("retrack", "track a take again from its blobs, as the daemon does, into a new take");
  command->examples(
      "  mocapctl take retrack walk-3.mcap --out walk-3b.mcap\n"
      "  mocapctl take retrack walk-3.mcap --rig mended-rig.toml --out walk-3b.mcap\n"
      "  mocapctl take retrack walk-3.mcap --settings my.toml --subjects subjects --range 2 12.5 --json\n"
      "  mocapctl take retrack walk-3.mcap --preset offline --out walk-3b.mcap");
  command->add_option("take", order.take, "the recorded take")->required()->type_name("TAKE.mcap");
  command
      ->add_option("--out", order.out,
                   "the new take; an existing file is never replaced. default: TAKE-retracked.mcap in this folder")
      ->type_name("NEW.mcap");
  command
      ->add_option("--settings", order.others.settings,
                   "the configuration to track with; default: the one that the take carries")
      ->type_name("FILE");
  command->add_option("--rig", order.others.rig, "another calibration of the same cameras")->type_name("FILE");
  command
      ->add_option("--subjects", order.others.subjects,
                   "folder with fitted bodies: NAME.toml replaces the body of the subject NAME")
      ->type_name("DIR");
  command
      ->add_option(
          "--range", line->range_s,
          "first and last instant of the new take, s after the start; tracking begins at the start in any case")
      ->expected(2)
      ->type_name("FROM TO");
  command
      ->add_option(
          "--preset", line->preset,
          "live: as the daemon does, set by set. offline: also backwards in time, so that subjects have labels "
          "before they were found, and gaps are filled from both sides; takes twice as long")
      ->check(cli::IsMember({"live", "offline"}));
  command->add_flag("--every-set", order.every_set,
                    "form the sets anew from all images, with those that the daemon passed over");
  command->add_flag("--json", line->json, "print JSON");
  command->callback([line, &chosen] { chosen = [line] { return run(*line); }; });
}

}  // namespace mocap::ctl
