#include "ctl/take/join_command.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <system_error>

#include "base/exit_codes.h"
#include "base/log.h"
#include "ctl/json_line.h"
#include "ctl/take/stop_signals.h"
#include "ctl/take/take_failure.h"
#include "lib/cli/status_line.h"
#include "lib/join/join.h"
#include "lib/retrack/chunk.h"
#include "lib/takes/take_report.h"

namespace mocap::ctl {
namespace {

using join::JoinReport;
namespace fs = std::filesystem;

void print_json(const JoinReport& report) {
  nlohmann::ordered_json json{{"file", report.path}, {"sets", report.sets}, {"kept", report.kept}};
  json["seams"] = nlohmann::ordered_json::array();
  for (const join::Seam& seam : report.seams) {
    json["seams"].push_back(
        {{"at_s", to_s(seam.at - report.start)}, {"agrees", seam.agrees}, {"differing_labels", seam.differing_labels}});
  }
  fmt::print("{}\n", json_line(json));
}

void print_text(const JoinReport& report) {
  if (report.kept) {
    fmt::print("{}: is there already; not joined again\n", report.path);
    return;
  }
  fmt::print("{}: {} sets of {} chunks\n", report.path, report.sets, report.seams.size() + 1);
  for (std::size_t i = 0; i < report.seams.size(); ++i) {
    const join::Seam& seam = report.seams[i];
    if (seam.agrees && seam.differing_labels == 0) continue;
    const double at_s = to_s(seam.at - report.start);
    if (seam.agrees) {
      fmt::print("  at {:.2f} s: chunks {} and {} have {} different labels\n", at_s, i + 1, i + 2,
                 seam.differing_labels);
    } else {
      fmt::print("  at {:.2f} s: chunks {} and {} do not agree about who is where; a longer --overlap may help\n", at_s,
                 i + 1, i + 2);
    }
  }
}

// Of the chunks of a new take, those that are there.
std::vector<fs::path> numbered_chunks(const fs::path& out, std::uint32_t count) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (std::uint32_t number = 1; number <= count; ++number) {
    fs::path file = retrack::chunk_file(out, {.number = number, .of = count});
    if (fs::exists(file, ignored)) files.push_back(std::move(file));
  }
  return files;
}

std::vector<fs::path> files_of(const JoinLine& line) {
  if (!line.chunks.empty()) return takes::takes_in(line.chunks);
  if (line.count > 0) return numbered_chunks(line.out, line.count);
  std::error_code ignored;
  const fs::path folder = retrack::chunk_folder(line.out);
  return fs::exists(folder, ignored) ? takes::takes_in({folder}) : std::vector<fs::path>();
}

// Says why there is nothing to join. Returns the exit code.
int report_no_chunks(const JoinLine& line) {
  const fs::path place = line.chunks.empty() ? retrack::chunk_folder(line.out) : line.chunks.front();
  return report_take_failure(
      {ErrorCode::NotFound, fmt::format("'{}' has no chunks ({}.mcap); mocapctl take retrack --chunk makes them",
                                        place.string(), line.count > 0 ? fmt::format("I-of-{}", line.count) : "*")});
}

// The chunk folder of the new take vanishes with its last file.
void remove_chunks(const fs::path& out, const std::vector<fs::path>& chunks) {
  std::error_code error;
  for (const fs::path& chunk : chunks) {
    if (!fs::remove(chunk, error) && error) {
      fmt::print(stderr, "mocapctl: '{}' is joined, but cannot be removed: {}\n", chunk.string(), error.message());
    }
  }
  fs::remove(retrack::chunk_folder(out), error);
}

}  // namespace

int join_chunks(const JoinLine& line) {
  const join::JoinOrder order{files_of(line), line.out, line.resume};
  std::error_code ignored;
  const bool may_be_joined = line.resume && line.chunks.empty() && fs::exists(line.out, ignored);
  if (order.chunks.empty() && !may_be_joined) return report_no_chunks(line);
  set_log_level(LogLevel::Warn);
  const StopSignals stops;
  const Result<JoinReport> report = [&] {
    cli::StatusLine status;
    return join::join(order, [&](double share) {
      status.show(fmt::format("mocapctl: joined {:.0f} %", 100.0 * share));
      return stops.count() == 0;
    });
  }();
  if (!report) {
    stops.end_program();
    return report_take_failure(report.error());
  }
  if (line.remove_chunks) remove_chunks(line.out, order.chunks);
  line.json ? print_json(*report) : print_text(*report);
  std::fflush(stdout);
  stops.end_program();
  return kExitOk;
}

void add_join_command(cli::App& take, std::function<int()>& chosen) {
  const auto line = std::make_shared<JoinLine>();
  cli::App* command = take.add_subcommand("join", "join the chunks of a take that 'take retrack --chunk' tracked");
  command->examples(
      "  mocapctl take retrack walk-3.mcap --out walk-3b.mcap --chunk 1/2\n"
      "  mocapctl take retrack walk-3.mcap --out walk-3b.mcap --chunk 2/2\n"
      "  mocapctl take join walk-3b.mcap");
  command->add_option("take", line->out, "the joined take; an existing file is never replaced")
      ->required()
      ->type_name("NEW.mcap");
  cli::Option* from =
      command->add_option("--from", line->chunks, "the chunks, in any order, or folders of them; default: NEW.chunks")
          ->type_name("PATH ...");
  command->add_option("--chunks", line->count, "only the chunks 1-of-N.mcap to N-of-N.mcap of NEW.chunks; default: all")
      ->type_name("N")
      ->check(cli::Range(2, static_cast<int>(retrack::kMostChunks)))
      ->excludes(from);
  command->add_flag("--remove-chunks", line->remove_chunks, "remove the chunks once they are joined");
  command->add_flag("--resume", line->resume,
                    "do nothing if the joined take is there, whole, and made of the chunks that are left");
  command->add_flag("--json", line->json, "print one line of JSON");
  command->callback([line, &chosen] { chosen = [line] { return join_chunks(*line); }; });
}

}  // namespace mocap::ctl
