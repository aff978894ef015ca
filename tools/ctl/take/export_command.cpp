#include "ctl/take/export_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/exit_codes.h"
#include "ctl/new_file.h"
#include "ctl/take/export_formats.h"
#include "ctl/take/export_report.h"
#include "ctl/take/take_failure.h"
#include "export/clip/clip_builder.h"
#include "export/clip/clip_from.h"
#include "export/clip/edit_clip.h"
#include "export/clip/rates.h"
#include "lib/cli/status_line.h"
#include "take/recordings/snapshot_reader.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;
using exports::Axes;
using exports::BoneNames;
using exports::Clip;
using exports::Unit;

struct ExportOptions {
  fs::path take, out;
  std::string format;  // empty: the extension of `out`
  std::optional<Rate> rate;
  std::vector<exports::RangeEnd> range;  // none, or both ends
  std::vector<std::string> subjects;
  std::optional<Axes> axes;
  std::optional<Unit> unit;
  BoneNames names = BoneNames::Skeleton;
  exports::Fill fill;
  bool json = false;
  bool progress = false;
};

Error wrong(std::string message) { return {ErrorCode::InvalidArgument, std::move(message)}; }

Result<const ExportFormat*> format_of(const ExportOptions& options) {
  std::string ending = options.out.extension().string();
  for (char& c : ending) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  if (ending == ".gltf") {
    return wrong(fmt::format("--out is '{}', but mocapctl writes .glb, the binary form of glTF; expected {}",
                             options.out.string(), fs::path(options.out).replace_extension(".glb").string()));
  }
  const bool given = !options.format.empty();
  const ExportFormat* format = format_named(given ? options.format : ending.substr(ending.empty() ? 0 : 1));
  if (format != nullptr) return format;
  std::vector<std::string_view> names;
  for (const ExportFormat& known : export_formats()) names.push_back(given ? known.name : known.extension);
  if (given) return wrong(fmt::format("--format is '{}', expected one of {}", options.format, fmt::join(names, ", ")));
  return wrong(fmt::format("--out is '{}' without --format, so its extension is expected to be one of {}",
                           options.out.string(), fmt::join(names, ", ")));
}

template <class Choice>
Result<Choice> chosen_of(const std::optional<Choice>& wish, const std::vector<Choice>& possible, std::string message) {
  if (!wish) return possible.front();
  if (std::ranges::find(possible, *wish) == possible.end()) return wrong(std::move(message));
  return *wish;
}

Result<exports::WriteOptions> write_options_of(const ExportOptions& options, const ExportFormat& format) {
  const auto axes =
      chosen_of(options.axes, format.axes,
                fmt::format("--axes: {} files are always {}", format.name, exports::name_of(format.axes.front())));
  if (!axes) return axes.error();
  const auto unit =
      chosen_of(options.unit, format.units,
                fmt::format("--unit: {} files are always in {}", format.name, exports::name_of(format.units.front())));
  if (!unit) return unit.error();
  return exports::WriteOptions{*axes, *unit, options.names};
}

Result<Clip> read_clip(const ExportOptions& options, ExportReport& report) {
  Result<std::unique_ptr<take::SnapshotReader>> recording = take::open_snapshots(options.take);
  if (!recording) return cannot_read(recording.error());
  exports::ClipBuilder builder(options.take.stem().string(), options.subjects);
  {
    cli::StatusLine line;
    const Status read = exports::read_into(builder, **recording, [&](double share) {
      if (options.progress) return fmt::print(stderr, "progress {:.3f}\n", share);
      line.show(fmt::format("mocapctl: reading {:.0f} %", 100.0 * share));
    });
    if (!read) return cannot_read(read.error());
  }
  Result<Clip> clip = builder.build();
  if (!clip) return wrong(fmt::format("{}: {}", options.take.string(), clip.error().message));
  report.recorded = builder.report();
  report.faults = (*recording)->faults();
  return clip;
}

Result<Clip> edited(Clip clip, const ExportOptions& options) {
  clip = exports::with_fill(std::move(clip), options.fill);
  if (!options.range.empty()) {
    Result<Clip> part = exports::cut(std::move(clip), options.range[0], options.range[1]);
    if (!part) return part.error();
    clip = std::move(*part);
  }
  if (options.rate) clip = exports::resampled(std::move(clip), *options.rate);
  return clip;
}

Status check_subjects(const Clip& clip, const ExportFormat& format) {
  if (clip.subjects.size() <= format.most_subjects) return {};
  std::vector<std::string> names;
  for (const exports::ClipSubject& subject : clip.subjects) names.push_back(subject.subject.name);
  return wrong(fmt::format("a {} file holds {} subject, the take has {}: choose with --subject", format.name,
                           format.most_subjects, fmt::join(names, ", ")));
}

Status export_take(const ExportOptions& options, const ExportFormat& format, const exports::WriteOptions& how) {
  Result<NewFile> file = NewFile::create(options.out);
  if (!file) return file.error();
  ExportReport report{.file = options.out, .format = &format, .options = how, .recorded = {}, .faults = {}};
  Result<Clip> recorded = read_clip(options, report);
  if (!recorded) return recorded.error();
  if (const Status fits = check_subjects(*recorded, format); !fits) return fits;
  Result<Clip> clip = edited(std::move(*recorded), options);
  if (!clip) return clip.error();
  if (clip->events.size() > format.most_marks) {
    report.marks_left_out = clip->events.size() - format.most_marks;
    clip->events.resize(format.most_marks);
  }
  const auto append = [&](std::string_view bytes) { return file->append(bytes); };
  if (const Status written = format.write(*clip, how, append); !written) return written;
  if (const Status finished = file->finish(); !finished) return finished;
  options.json ? print_export_json(report, *clip) : print_export_text(report, *clip);
  return {};
}

int usage_error(const std::string& message) {
  fmt::print(stderr, "mocapctl: {}\n", message);
  return kExitUsage;
}

int run_export(ExportOptions options) {
  const Result<const ExportFormat*> format = format_of(options);
  if (!format) return usage_error(format.error().message);
  const Result<exports::WriteOptions> how = write_options_of(options, **format);
  if (!how) return usage_error(how.error().message);
  std::error_code ignored;
  if (options.out.empty() || fs::is_directory(options.out, ignored)) {
    options.out /= options.take.stem().string() + '.' + std::string((*format)->extension);
  }
  const Status done = export_take(options, **format, *how);
  return done ? kExitOk : report_take_failure(done.error());
}

using Fault = std::optional<std::string>;

Fault read_fill(const std::string& text, exports::Fill& fill) {
  fill = {};
  if (text == "recorded") return std::nullopt;
  fill.recorded = text != "none";
  if (text == "none") return std::nullopt;
  int ms = 0;
  char more = 0;
  if (std::sscanf(text.c_str(), "%d%c", &ms, &more) != 1 || ms < 1) {
    return fmt::format("'{}', expected none, recorded, or the longest gap in ms", text);
  }
  fill.longest_s = 1e-3 * ms;
  return std::nullopt;
}

Fault read_rate(const std::string& text, std::optional<Rate>& rate) {
  rate = exports::parse_rate(text);
  if (rate) return std::nullopt;
  return fmt::format("'{}', expected 1 to 10000, for example 120, 29.97 or 30000/1001", text);
}

void add_selection(cli::App& command, ExportOptions& options, std::vector<std::string>& range) {
  command.add_option("--subject", options.subjects, "only this subject; may be repeated")
      ->one_value_each()
      ->type_name("NAME");
  command
      .add_option("--range", range, "first and last: seconds (12.5), frames from 0 (1500f) or timecode (01:02:03:04)")
      ->expected(2)
      ->type_name("FROM TO");
  command
      .add_option(
          "--fps", [&options](const std::string& text) { return read_rate(text, options.rate); },
          "frames per second; default: as recorded, every frame exact")
      ->type_name("RATE");
  command
      .add_option(
          "--fill", [&options](const std::string& text) { return read_fill(text, options.fill); },
          "what gaps get: none; recorded (default): markers that the daemon predicted; or MS: these, and gaps up to MS "
          "ms interpolated")
      ->type_name("none|recorded|MS");
}

void add_conventions(cli::App& command, ExportOptions& options) {
  command.add_choice<std::optional<Axes>>(
      "--axes", options.axes, {{"z-up", Axes::ZUp}, {"y-up", Axes::YUp}},
      "right-handed axes of c3d, trc, csv; y-up is y, z, x: the subject faces +z, as in bvh, gltf, usd and fbx, which "
      "are always y-up. default: y-up for trc, else z-up");
  command.add_choice<std::optional<Unit>>(
      "--unit", options.unit, {{"m", Unit::Metre}, {"cm", Unit::Centimetre}, {"mm", Unit::Millimetre}},
      "default: mm for c3d and trc, m for csv, cm for bvh; fbx is always in cm, gltf and usd in m");
  command.add_choice<BoneNames>("--names", options.names,
                                {{"skeleton", BoneNames::Skeleton},
                                 {"humanbodybones", BoneNames::HumanBodyBones},
                                 {"mannequin", BoneNames::Mannequin},
                                 {"mixamo", BoneNames::Mixamo},
                                 {"humanik", BoneNames::HumanIk}},
                                "names of the bones; default: skeleton, as its file has them");
}

// The options of a command line, and the texts that are read when all options are known.
struct ExportCommandLine {
  ExportOptions options;
  std::vector<std::string> range;
};

int run_command(ExportCommandLine& line) {
  for (const std::string& text : line.range) {
    const auto end = exports::parse_range_end(text);
    if (!end) {
      return usage_error(
          fmt::format("--range: '{}' is neither seconds (12.5), a frame (1500f) nor a timecode (01:02:03:04)", text));
    }
    line.options.range.push_back(*end);
  }
  if (line.options.out.empty() && line.options.format.empty()) {
    return usage_error("give --format, or --out with the extension of a format");
  }
  return run_export(line.options);
}

}  // namespace

void add_export_command(cli::App& take, std::function<int()>& chosen) {
  const auto line = std::make_shared<ExportCommandLine>();
  ExportOptions& options = line->options;
  cli::App* command =
      take.add_subcommand("export", "write a take as a file of another program; c3d files have its marks, as events");
  command->examples(
      "  mocapctl take export walk-3.mcap --out walk.c3d\n"
      "  mocapctl take export walk-3.mcap --format trc --unit m --subject anna\n"
      "  mocapctl take export walk-3.mcap --out walk.fbx --names humanik\n"
      "  mocapctl take export walk.pb --out walk.csv --fps 29.97 --range 2 12.5\n"
      "  mocapctl take export walk.pb --out walk.c3d --fill 100 --range 240f 1200f");
  command->add_option("take", options.take, "a take (.mcap), or snapshots of [record] (.pb, .jsonl)")
      ->required()
      ->type_name("TAKE");
  std::vector<std::string> formats;
  std::string about;
  for (const ExportFormat& format : export_formats()) {
    formats.emplace_back(format.name);
    about += fmt::format("{}{} ({})", about.empty() ? "" : ", ", format.name, format.about);
  }
  command->add_option("--format", options.format, about + "; default: the extension of --out")
      ->check(cli::IsMember(formats));
  command
      ->add_option(
          "--out", options.out,
          "the file to write, or a folder for TAKE with another extension; an existing file is never replaced. "
          "default: in this folder")
      ->type_name("FILE");
  add_selection(*command, options, line->range);
  add_conventions(*command, options);
  command->add_flag("--json", options.json, "print JSON");
  command->add_flag("--progress", options.progress,
                    "print lines \"progress SHARE\", 0 to 1, to standard error, for a program that waits");
  command->callback([line, &chosen] { chosen = [line] { return run_command(*line); }; });
}

}  // namespace mocap::ctl
