#include "ctl/take/retrack_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "base/time.h"
#include "ctl/json_line.h"
#include "ctl/take/retrack_takes.h"
#include "ctl/take/stop_signals.h"
#include "ctl/take/take_failure.h"
#include "lib/cli/status_line.h"
#include "lib/farm/unit.h"
#include "lib/retrack/retrack.h"

namespace mocap::ctl {
namespace {

using retrack::RetrackOrder;
using retrack::RetrackProgress;
using retrack::RetrackReport;

struct RetrackCommandLine {
  RetrackOrder order;
  RetrackTakes several;         // `takes` has the takes in any case
  std::vector<double> range_s;  // none, or both ends
  double overlap_s = 5.0;       // of chunks
  std::string preset = "live";
  bool json = false;
  bool progress = false;
};

// Share, speed and the time that is left.
std::string progress_line(const RetrackProgress& progress, double spent_s) {
  return fmt::format("mocapctl: tracked {:.0f} %, {:.0f} sets/s, {:.0f} s left", 100.0 * progress.share,
                     static_cast<double>(progress.sets) / spent_s, spent_s / progress.share - spent_s);
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
                              {"from_start_of_run", report.from_start_of_run},
                              {"from_belief", report.from_belief},
                              {"kept", report.kept}};
  json["first_difference"] = nullptr;
  if (report.first_difference) json["first_difference"] = *report.first_difference;
  fmt::print("{}\n", json_line(json));
}

void print_text(const RetrackReport& report, bool is_chunk, double spent_s) {
  if (report.kept) {
    fmt::print("{}: is there, made of the same take and settings by this version; not tracked again\n", report.path);
    return;
  }
  fmt::print("{}: {} sets in {:.2f} s, {:.1f} times as fast as they were recorded\n", report.path, report.sets, spent_s,
             report.seconds / spent_s);
  if (report.recorded > 0) {
    fmt::print("{} of {} snapshots are those of the recording, byte for byte\n", report.equal, report.recorded);
  }
  if (report.first_difference) {
    fmt::print("set {} is the first that differs{}\n", *report.first_difference,
               report.from_start_of_run || report.from_belief ? ""
               : is_chunk                                     ? ": a chunk begins from nothing"
                          : ": the recording began while the daemon was tracking already");
  }
  if (report.missing_views > 0) fmt::print("{} images that the daemon had are not in the take\n", report.missing_views);
  if (report.damaged > 0) fmt::print("{} damaged messages were left out\n", report.damaged);
}

bool is_range(const std::vector<double>& range_s) {
  return range_s[0] >= 0.0 && range_s[1] > range_s[0] && range_s[1] < 1e6;
}

int run_one(const RetrackCommandLine& line) {
  RetrackOrder order = line.order;
  order.take = line.several.takes.front();
  if (order.out.empty()) order.out = farm::default_out(order.take);
  if (!line.range_s.empty()) {
    order.from = from_s(line.range_s[0]);
    order.to = from_s(line.range_s[1]);
  }
  order.offline = line.preset == "offline";
  if (order.chunk) order.chunk->overlap = from_s(line.overlap_s);
  set_log_level(LogLevel::Warn);
  const StopSignals stops;
  const Timestamp started = host_now();
  const Result<RetrackReport> report = [&] {
    cli::StatusLine status;
    return retrack::retrack(order, [&](const RetrackProgress& now) {
      if (line.progress) {
        fmt::print(stderr, "progress {:.4f}\n", now.share);
      } else if (now.share > 0.0) {
        status.show(progress_line(now, to_s(host_now() - started)));
      }
      return stops.count() == 0;
    });
  }();
  if (!report) {
    stops.end_program();
    return report_take_failure(report.error());
  }
  const double spent_s = std::max(to_s(host_now() - started), 1e-6);
  line.json ? print_json(*report, spent_s) : print_text(*report, order.chunk.has_value(), spent_s);
  return kExitOk;
}

// The options that the command of each take has, too. It may run in another folder.
std::vector<std::string> options_of(const RetrackCommandLine& line) {
  std::vector<std::string> options;
  const auto add_path = [&](const char* name, const std::filesystem::path& path) {
    if (!path.empty()) options.insert(options.end(), {name, std::filesystem::absolute(path).string()});
  };
  add_path("--settings", line.order.others.settings);
  add_path("--rig", line.order.others.rig);
  add_path("--subjects", line.order.others.subjects);
  if (!line.range_s.empty()) {
    options.insert(options.end(), {"--range", fmt::format("{}", line.range_s[0]), fmt::format("{}", line.range_s[1])});
  }
  if (line.several.chunks > 0) options.insert(options.end(), {"--overlap", fmt::format("{}", line.overlap_s)});
  if (line.preset != "live") options.insert(options.end(), {"--preset", line.preset});
  if (line.order.every_set) options.emplace_back("--every-set");
  if (line.order.resume) options.emplace_back("--resume");
  return options;
}

bool is_folder(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

int run(const RetrackCommandLine& line) {
  if (!line.range_s.empty() && !is_range(line.range_s)) {
    fmt::print(stderr, "mocapctl: --range is {} {}, expected two times in s, from 0 on, the first one the smaller\n",
               line.range_s[0], line.range_s[1]);
    return kExitUsage;
  }
  RetrackTakes several = line.several;
  const bool one = several.takes.size() == 1 && several.out_dir.empty() && !is_folder(several.takes.front());
  if (one && several.jobs == 0 && several.farm.empty() && several.chunks == 0) return run_one(line);
  if (line.order.chunk) {
    fmt::print(stderr,
               "mocapctl: --chunk is for one take and one process; expected --chunks N, which tracks them all\n");
    return kExitUsage;
  }
  if (!line.order.out.empty() && !(one && several.farm.empty())) {
    fmt::print(stderr, "mocapctl: --out is for one take; expected --out-dir DIR for several\n");
    return kExitUsage;
  }
  if (!several.farm.empty() && several.out_dir.empty()) {
    fmt::print(stderr, "mocapctl: --farm needs --out-dir DIR, a folder that all machines of the farm see\n");
    return kExitUsage;
  }
  several.out = line.order.out;
  several.options = options_of(line);
  several.resume = line.order.resume;
  several.json = line.json;
  several.progress = line.progress;
  return retrack_takes(several);
}

// The takes, their new takes, and who tracks them.
void add_takes(cli::App& command, RetrackCommandLine& line) {
  command.add_option("take", line.several.takes, "the recorded takes, or folders of them")
      ->required()
      ->type_name("TAKE.mcap");
  command
      .add_option("--out-dir", line.several.out_dir,
                  "folder of the new takes, which have the names of the recorded ones")
      ->type_name("DIR");
  command
      .add_option(
          "--jobs", line.several.jobs,
          "how many takes or chunks are tracked at a time, each by a process of its own; default for several: the "
          "number of processors")
      ->check(cli::Range(1, 1024))
      ->type_name("N");
  cli::Option* farm =
      command
          .add_option(
              "--farm", line.several.farm,
              "who tracks the takes, one task for each. slurm: a job array is submitted and waited for. parallel: "
              "GNU parallel, here or on the hosts that $PARALLEL names. openjd: a job template for render "
              "managers is written. Scripts and logs are in DIR/farm")
          ->check(cli::IsMember({"slurm", "parallel", "openjd"}));
  command.add_flag("--dry-run", line.several.dry_run, "with --farm: write the scripts, print the command, run nothing")
      ->needs(farm);
  command.add_flag("--resume", line.order.resume,
                   "skip a take whose new take is there, whole, and made of the same recorded take, settings and "
                   "options by this version");
  command
      .add_option("--out", line.order.out,
                  "the new take of one take; an existing file is never replaced. default: TAKE-retracked.mcap in this "
                  "folder")
      ->type_name("NEW.mcap");
}

// Takes that are cut into chunks.
void add_chunks(cli::App& command, RetrackCommandLine& line) {
  cli::Option* chunks = command
                            .add_option("--chunks", line.several.chunks,
                                        "track each take in this many chunks of equal duration, side by side, and join "
                                        "them; the result depends on their number, not on who tracks them")
                            ->check(cli::Range(2, static_cast<int>(retrack::kMostChunks)))
                            ->type_name("N");
  cli::Option* chunk = command
                           .add_option(
                               "--chunk",
                               [&line](const std::string& text) -> std::optional<std::string> {
                                 const Result<retrack::Chunk> read = retrack::parse_chunk(text);
                                 if (!read) return read.error().message;
                                 line.order.chunk = *read;
                                 return std::nullopt;
                               },
                               "track this chunk alone, into NEW.chunks/I-of-N.mcap; 'take join NEW.mcap' joins them")
                           ->excludes(chunks)
                           ->type_name("I/N");
  cli::Option* range = command.get_option("--range");
  for (cli::Option* option : {chunks, chunk}) option->excludes(range);
  command
      .add_option(
          "--overlap", line.overlap_s,
          "seconds that a chunk begins before the end of the one before it: subjects are found and poses settle "
          "in them")
      ->check(cli::Range(0.1, 600.0))
      ->type_name("S")
      ->capture_default_str();
}

// With what and how each take is tracked.
void add_tracking(cli::App& command, RetrackCommandLine& line) {
  command
      .add_option("--settings", line.order.others.settings,
                  "the configuration to track with; default: the one that the take carries")
      ->type_name("FILE");
  command.add_option("--rig", line.order.others.rig, "another calibration of the same cameras")->type_name("FILE");
  command
      .add_option("--subjects", line.order.others.subjects,
                  "folder with fitted bodies: NAME.toml replaces the body of the subject NAME")
      ->type_name("DIR");
  command
      .add_option("--range", line.range_s,
                  "first and last instant of the new take, s after the start; tracking begins at the start in any case")
      ->expected(2)
      ->type_name("FROM TO");
  command
      .add_option("--preset", line.preset,
                  "live: as the daemon does, set by set. offline: also backwards in time, so that subjects have labels "
                  "before they were found, and gaps are filled from both sides; takes twice as long")
      ->check(cli::IsMember({"live", "offline"}));
  command.add_flag("--every-set", line.order.every_set,
                   "form the sets anew from all images, with those that the daemon passed over");
}

}  // namespace

void add_retrack_command(cli::App& take, std::function<int()>& chosen) {
  const auto line = std::make_shared<RetrackCommandLine>();
  cli::App* command =
      take.add_subcommand("retrack", "track takes again from their blobs, as the daemon does, into new takes");
  command->examples(
      "  mocapctl take retrack walk-3.mcap --out walk-3b.mcap\n"
      "  mocapctl take retrack walk-3.mcap --rig mended-rig.toml --out walk-3b.mcap\n"
      "  mocapctl take retrack walk-3.mcap --settings my.toml --subjects subjects --range 2 12.5 --json\n"
      "  mocapctl take retrack walk-3.mcap --preset offline --out walk-3b.mcap\n"
      "  mocapctl take retrack takes/*.mcap --rig mended-rig.toml --out-dir mended\n"
      "      in several processes; go on after an interruption: the same with --resume\n"
      "  mocapctl take retrack takes --out-dir again --farm slurm --jobs 20\n"
      "  mocapctl take retrack long.mcap --out long-b.mcap --chunks 8\n"
      "      one long take on all processors");
  add_takes(*command, *line);
  add_tracking(*command, *line);
  add_chunks(*command, *line);
  command->add_flag("--json", line->json, "print one line of JSON for each take");
  command->add_flag("--progress", line->progress,
                    "print lines \"progress SHARE\", 0 to 1, to standard error, for a program that waits");
  command->callback([line, &chosen] { chosen = [line] { return run(*line); }; });
}

}  // namespace mocap::ctl
