#include "ctl/subject/subject_command.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "base/replace_file.h"
#include "base/time.h"
#include "ctl/json_line.h"
#include "ctl/subject/import_files.h"
#include "ctl/subject/labelled_takes.h"
#include "ctl/subject/marker_set_drawing.h"
#include "ctl/subject/subject_report.h"
#include "ctl/take/take_failure.h"
#include "identify/asymmetry.h"
#include "lib/cli/shown_text.h"
#include "lib/functional/motion_import.h"
#include "scene/import_marker_set.h"
#include "settings/shipped_files.h"
#include "settings/subject/marker_set_file.h"
#include "settings/subject/subject_file.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

template <class... Arguments>
void say(fmt::format_string<Arguments...> text, Arguments&&... arguments) {
  fmt::print(stderr, "mocapctl: {}\n", fmt::format(text, std::forward<Arguments>(arguments)...));
}

std::string utc_now() {
  const std::time_t seconds = static_cast<std::time_t>(to_ns(host_now() + utc_minus_host()) / 1'000'000'000);
  std::tm utc{};
  ::gmtime_r(&seconds, &utc);
  char text[32];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc)};
}

// Joints with a larger rms distance are reported: the bone between both has too few markers, or the joint did not bend.
// Chosen by hand; not yet measured.
constexpr double kLooseJoint_m = 0.030;

void warn_of_loose_joints(const std::vector<functional::FoundJoint>& joints) {
  for (const functional::FoundJoint& joint : joints) {
    if (joint.rms_m < kLooseJoint_m) continue;
    say("the joint between {} and {} moves by {:.0f} mm, expected less than {:.0f}: a bone between them has too few "
        "markers, or no joint of it bends in this take",
        joint.bone, joint.parent, 1e3 * joint.rms_m, 1e3 * kLooseJoint_m);
  }
}

settings::SubjectFile file_of(const bodyfit::FittedSubject& fitted, const SubjectOptions& options,
                              const fs::path& marker_set) {
  return {.name = options.name.empty() ? fs::path(options.out).stem().string() : options.name,
          .marker_set_file = marker_set,
          .fitted_on = options.date.empty() ? utc_now() : options.date,
          .size = fitted.size,
          .residual_m = fitted.residuals.rms_m,
          .marker_set = fitted.marker_set,
          .bone_residuals_m = fitted.residuals.bone_rms_m,
          .marker_residuals_m = fitted.residuals.marker_rms_m};
}

// Whether the file is the one that standard output goes to, as /dev/stdout: it is there for the output.
bool is_standard_output(const fs::path& out) {
  struct stat file {};
  struct stat output {};
  return ::stat(out.c_str(), &file) == 0 && ::fstat(STDOUT_FILENO, &output) == 0 && file.st_dev == output.st_dev &&
         file.st_ino == output.st_ino;
}

// A pipe or a device is no file that could be lost.
Status check_absent_or_replaced(const SubjectOptions& options) {
  std::error_code ignored;
  if (options.replace || !fs::is_regular_file(options.out, ignored)) return {};
  return Error{ErrorCode::InvalidArgument,
               fmt::format("{} exists and is kept; expected another --out, or --replace", options.out.string())};
}

// Only a regular file is replaced: a pipe, a device or the file behind a link is written.
Status write_picture(const fs::path& out, const std::string& svg) {
  std::error_code ignored;
  const fs::file_type type = fs::symlink_status(out, ignored).type();
  if (type == fs::file_type::regular || type == fs::file_type::not_found) return replace_file(out, svg);
  std::ofstream file(out, std::ios::binary);
  if (file << svg && file.flush()) return {};
  return Error{ErrorCode::Io, fmt::format("--out is '{}', which cannot be written", out.string())};
}

// Empty, with an error message, if the takes contain too few markers.
std::optional<bodyfit::FittedSubject> fit_body(const MarkerSet& set, const bodyfit::LabelledTake& at_rest,
                                               const bodyfit::LabelledTake& moving) {
  const auto fitted = bodyfit::fit_subject(set, at_rest, moving, {});
  if (!fitted) {
    say("{} frames at rest and {} moving show too few of the {} markers of '{}' to fit a body", at_rest.frames(),
        moving.frames(), set.markers.size(), set.name);
    return std::nullopt;
  }
  if (!fitted->from_rest && set.skeleton.bones.size() > 1) {
    say("without a T-pose or A-pose the axes of the bones are those of the marker set");
  }
  return *fitted;
}

// Exit code for a file that cannot be loaded.
int exit_of_file(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored) ? kExitConfig : kExitNoInput;
}

// Reports an import. `imported_set`: the marker set that was written next to the subject file `out`.
void report_import(const SubjectOptions& options, const functional::MotionImport& import, const MarkerSet& imported_set,
                   const settings::SubjectFile& subject, const fs::path& out) {
  const scene::ImportedMarkerSet& imported = import.imported;
  std::vector<std::array<std::string, 2>> asymmetric;
  for (const auto& [one, other] : imported_set.asymmetric)
    asymmetric.push_back({imported_set.markers[one].name, imported_set.markers[other].name});
  if (options.json) {
    Json all = json_of(subject);
    all["unknown"] = imported.unknown;
    all["twice"] = imported.twice;
    all["never_seen"] = imported.never_seen;
    all["ghosts"] = imported.ghosts;
    all["model_outputs"] = imported.model_outputs;
    all["asymmetric"] = asymmetric;
    if (!import.joints.empty()) all["joints"] = json_of(import.joints);
    all["marker_set_file"] = subject.marker_set_file.string();
    all["subject_file"] = out.string();
    fmt::print("{}\n", json_line(all, 2));
  } else {
    print(subject);
    print(import.joints);
    fmt::print("\n{} unlabelled points and {} model outputs left out\n", imported.ghosts, imported.model_outputs);
    for (const auto& [one, other] : asymmetric)
      fmt::print("{} and {} are not symmetric seen from the front: they distinguish left from right\n", one, other);
    fmt::print("written: {} and {}\n", subject.marker_set_file.string(), out.string());
  }
}

// A marker set, and the file of its skeleton.
struct Import {
  functional::MotionImport found;
  fs::path skeleton_file;
};

// Imports by the conventions of the labels, with the skeleton of --skeleton. Fails with NotFound if it cannot be
// loaded.
Result<Import> import_by_labels(const SubjectOptions& options, const scene::C3d& c3d) {
  const settings::FoundFile file =
      settings::find_shipped(options.skeleton.empty() ? "skeletons/human18.toml" : options.skeleton, {});
  if (!file.missing.empty()) return Error{ErrorCode::NotFound, "--skeleton: " + file.missing};
  const auto skeleton = settings::load_skeleton(file.path);
  if (!skeleton) return Error{ErrorCode::NotFound, skeleton.error().message};
  auto imported = scene::import_marker_set(c3d, *skeleton, options.name);
  if (!imported) return imported.error();
  return Import{{.imported = *std::move(imported)}, file.path};
}

// Imports by the motion of the markers, with a skeleton of its own.
Result<Import> import_by_motion(const SubjectOptions& options, const scene::C3d& c3d) {
  say("bones and joints are found in the motion: the labels follow no convention, or --by-motion is given");
  auto found = functional::import_by_motion(c3d, options.name);
  if (!found) return found.error();
  for (const std::string& label : found->left_out)
    say("marker '{}' is never seen together with the others; left out", cli::shown(label));
  warn_of_loose_joints(found->joints);
  return Import{*std::move(found), import_files(options.out, options.name, true).skeleton};
}

void add_import(cli::App& subject, SubjectOptions& options) {
  cli::App* command = subject.add_subcommand(
      "import", "make a marker set from the labels of a C3D file, with its asymmetric marker pairs, and fit the body");
  command->examples(
      "  mocapctl subject import static.c3d --name anna --static --out subjects\n"
      "  mocapctl subject import walk.c3d --name bob --out subjects --json\n"
      "  mocapctl subject import stretching.c3d --name eve --out subjects --by-motion");
  command->add_option("file", options.file, "a C3D file")->required()->type_name("FILE.c3d");
  command->add_option("--name", options.name, "name of the subject and its marker set")->required();
  command->add_flag("--static", options.at_rest, "the file is a static trial: a person stands in T-pose or A-pose");
  command->add_flag(
      "--by-motion", options.by_motion,
      "find bones and joints in the motion, whatever the labels are; without --skeleton also done if most "
      "labels follow no convention (Plug-in Gait, Motive, Arena)");
  command->add_option("--skeleton", options.skeleton, "default: skeletons/human18.toml of the shipped ones")
      ->type_name("FILE");
  command
      ->add_option("--out", options.out,
                   "output folder of NAME.markers.toml, NAME.subject.toml and, by motion, NAME.skeleton.toml")
      ->required()
      ->type_name("DIR");
  command->add_flag("--replace", options.replace, "replace these files if they exist");
  command->callback([&options] { options.run = run_import; });
  command->add_flag("--json", options.json, "print JSON");
  command->add_option("--date", options.date, "date in the file; default: now, UTC")->type_name("TEXT");
}

void add_fit(cli::App& subject, SubjectOptions& options) {
  cli::App* command = subject.add_subcommand("fit", "fit a body to a recording with labelled markers");
  command->examples(
      "  mocapctl subject fit --c3d walk.c3d --rest static.c3d --marker-set subjects/anna.markers.toml --out "
      "anna.toml\n"
      "  mocapctl subject fit --stream take.jsonl --rest-s 2 --marker-set markersets/baseline41.toml --out anna.toml");
  command->add_option("--stream", options.stream, "a recorded feed, JSON lines")->type_name("FILE.jsonl");
  command->add_option("--c3d", options.c3d, "a C3D file")->type_name("FILE.c3d");
  command->add_option("--rest", options.rest, "a static trial of the same body")->type_name("FILE.c3d");
  command->add_option("--rest-s", options.rest_s, "duration of the T-pose or A-pose at the start of the feed, s")
      ->check(cli::Range(0.0, 600.0));
  command->add_option("--subject", options.subject, "index of the subject in the feed, from 0")->capture_default_str();
  command
      ->add_option("--marker-set", options.marker_set,
                   "marker set of the recording: a file, or a shipped one as markersets/baseline41.toml")
      ->required()
      ->type_name("FILE.toml");
  command->add_option("--name", options.name, "name of the subject; default: name of the output file");
  command->add_option("--out", options.out, "the subject file to write")->required()->type_name("FILE.toml");
  command->add_flag("--replace", options.replace, "replace this file if it exists");
  command->callback([&options] { options.run = run_fit; });
  command->add_flag("--json", options.json, "print JSON");
  command->add_option("--date", options.date, "date in the file; default: now, UTC")->type_name("TEXT");
}

void add_show(cli::App& subject, SubjectOptions& options) {
  cli::App* command = subject.add_subcommand("show", "print a table of lengths, markers and residuals");
  command->examples(
      "  mocapctl subject show subjects/anna.subject.toml\n"
      "  mocapctl subject show anna.toml --json");
  command->add_option("file", options.file, "a subject file")->required()->type_name("FILE.toml");
  command->callback([&options] { options.run = run_show; });
  command->add_flag("--json", options.json, "print JSON");
}

void add_draw(cli::App& subject, SubjectOptions& options) {
  cli::App* command = subject.add_subcommand("draw", "draw a marker set as SVG: two views with bones and labels");
  command->examples(
      "  mocapctl subject draw config/markersets/baseline41.toml --out baseline41.svg\n"
      "  mocapctl subject draw anna.toml > anna.svg");
  command->add_option("markerset", options.marker_set, "a marker set or a subject file")
      ->required()
      ->type_name("FILE.toml");
  command->add_option("--out", options.out, "the picture to write; default: standard output")->type_name("FILE.svg");
  command->add_flag("--replace", options.replace, "replace this file if it exists");
  command->callback([&options] { options.run = run_draw; });
}

}  // namespace

int run_import(const SubjectOptions& options) {
  if (options.by_motion && !options.skeleton.empty()) {
    say("--by-motion makes a skeleton of its own; expected either --by-motion or --skeleton");
    return kExitUsage;
  }
  const auto c3d = read_c3d(options.file);
  if (!c3d) return report_take_failure(c3d.error());
  const bool by_motion = options.by_motion || (options.skeleton.empty() && functional::has_own_labels(*c3d));
  if (by_motion && options.at_rest) {
    say("{}: the labels follow no convention (Plug-in Gait, Motive or Arena), and a static trial does not show where "
        "joints are; import a take in which every joint bends, without --static",
        options.file.string());
    return kExitData;
  }
  const ImportFiles files = import_files(options.out, options.name, by_motion);
  if (!options.replace) {
    if (const Status absent = check_absent(files); !absent) return report_take_failure(absent.error());
  }
  const auto import = by_motion ? import_by_motion(options, *c3d) : import_by_labels(options, *c3d);
  if (!import && import.error().code == ErrorCode::NotFound) {
    say("{}", import.error().message);
    return kExitConfig;
  }
  if (!import)
    return report_take_failure(
        {import.error().code, fmt::format("{}: {}", options.file.string(), import.error().message)});
  const scene::ImportedMarkerSet& imported = import->found.imported;
  for (const std::string& label : imported.unknown) say("label '{}' is unknown; left out", cli::shown(label));
  for (const std::string& label : imported.twice) say("label '{}' occurs twice; the first is used", cli::shown(label));

  const bodyfit::LabelledTake take = scene::take_of(*c3d, imported.marker_set);
  const auto fitted = fit_body(imported.marker_set, options.at_rest ? take : bodyfit::LabelledTake{},
                               options.at_rest ? bodyfit::LabelledTake{} : take);
  if (!fitted) return kExitData;
  const MarkerSet imported_set = identify::with_asymmetries(imported.marker_set, *fitted);
  const settings::SubjectFile subject = file_of(*fitted, options, files.marker_set);
  if (const Status saved = save_import(files, imported_set, import->skeleton_file, subject, options.replace); !saved) {
    return report_take_failure(saved.error());
  }
  report_import(options, import->found, imported_set, subject, files.subject);
  return kExitOk;
}

int run_fit(const SubjectOptions& options) {
  if (options.stream.empty() == options.c3d.empty() && (options.rest.empty() || !options.stream.empty())) {
    say("expected a recording: one of --stream FILE.jsonl and --c3d FILE.c3d, or --rest FILE.c3d alone");
    return kExitUsage;
  }
  if (options.out.extension() != ".toml") {
    say("--out is '{}', expected a subject file FILE.toml", options.out.string());
    return kExitUsage;
  }
  if (const Status absent = check_absent_or_replaced(options); !absent) return report_take_failure(absent.error());
  const settings::FoundFile set_file = settings::find_shipped(options.marker_set, {});
  if (!set_file.missing.empty()) {
    say("--marker-set: {}", set_file.missing);
    return kExitConfig;
  }
  const auto set = settings::load_marker_set(set_file.path);
  if (!set) {
    say("{}", set.error().message);
    return kExitConfig;
  }
  StreamTakes takes;
  takes.at_rest.markers = takes.moving.markers = set->markers.size();
  if (!options.stream.empty()) {
    auto read = read_stream(options.stream, options.subject, *set, options.rest_s);
    if (!read) return report_take_failure(read.error());
    takes = *std::move(read);
  }
  for (const auto& [path, take] : {std::pair{options.c3d, &takes.moving}, {options.rest, &takes.at_rest}}) {
    if (path.empty()) continue;
    const auto c3d = read_c3d(path);
    if (!c3d) return report_take_failure(c3d.error());
    *take = scene::take_of(*c3d, *set);
  }
  const auto fitted = fit_body(*set, takes.at_rest, takes.moving);
  if (!fitted) return kExitData;
  const settings::SubjectFile subject = file_of(*fitted, options, set_file.path);
  const Status saved = settings::save_subject(options.out, subject);
  if (!saved) return report_take_failure(saved.error());
  if (options.json) {
    fmt::print("{}\n", json_line(json_of(subject), 2));
  } else {
    print(subject);
    fmt::print("\nwritten: {}\n", options.out.string());
  }
  return kExitOk;
}

int run_show(const SubjectOptions& options) {
  const auto subject = settings::load_subject(options.file);
  if (!subject) {
    fmt::print(stderr, "{}\n", settings::to_text(subject.error()));
    return exit_of_file(options.file);
  }
  if (options.json) {
    fmt::print("{}\n", json_line(json_of(*subject), 2));
  } else {
    print(*subject);
  }
  return kExitOk;
}

int run_draw(const SubjectOptions& options) {
  auto set = settings::load_marker_set(options.marker_set);
  if (!set) {
    // The file of a fitted body has its markers too.
    auto subject = settings::load_subject(options.marker_set);
    if (!subject) {
      say("{}", set.error().message);
      return exit_of_file(options.marker_set);
    }
    set = std::move(subject->marker_set);
  }
  const std::string svg = marker_set_svg(*set);
  if (options.out.empty() || is_standard_output(options.out)) {
    fmt::print("{}", svg);
    return kExitOk;
  }
  Status saved = check_absent_or_replaced(options);
  if (saved) saved = write_picture(options.out, svg);
  return saved ? kExitOk : report_take_failure(saved.error());
}

void add_subject_command(cli::App& app, SubjectOptions& options) {
  cli::App* subject = app.add_subcommand("subject", "bodies: import, fit, show, draw");
  subject->examples(
      "  mocapctl subject import static.c3d --name anna --static --out subjects\n"
      "  mocapctl subject show subjects/anna.subject.toml\n"
      "  mocapctl subject reset anna");
  subject->require_subcommand(1);
  add_import(*subject, options);
  add_fit(*subject, options);
  add_show(*subject, options);
  add_draw(*subject, options);
}

}  // namespace mocap::ctl
