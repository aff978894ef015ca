#include "ctl/subject_command.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "base/time.h"
#include "ctl/takes.h"
#include "identify/asymmetry.h"
#include "scene/import_marker_set.h"
#include "settings/marker_set_file.h"
#include "settings/subject_file.h"

namespace mocap::ctl {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kExitData = 65;  // sysexits EX_DATAERR

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

// Where human18 stands: below this folder, or one above it that has a configuration.
std::optional<fs::path> usual_skeleton() {
  std::error_code ignored;
  for (fs::path folder = fs::current_path(ignored);; folder = folder.parent_path()) {
    for (const char* config : {"config", "."}) {
      const fs::path file = folder / config / "skeletons" / "human18.toml";
      if (fs::exists(file, ignored)) return file;
    }
    if (folder == folder.root_path()) return std::nullopt;
  }
}

Json json_of(const settings::SubjectFile& subject) {
  Json bones = Json::array(), markers = Json::array();
  for (std::size_t b = 0; b < subject.marker_set.skeleton.bones.size(); ++b) {
    const Bone& bone = subject.marker_set.skeleton.bones[b];
    bones.push_back({{"name", bone.name},
                     {"length_mm", bone.parent < 0 ? 0.0 : 1e3 * bone.rest_offset_m.norm()},
                     {"residual_mm", 1e3 * subject.bone_residuals_m[b]}});
  }
  for (std::size_t m = 0; m < subject.marker_set.markers.size(); ++m) {
    markers.push_back(
        {{"name", subject.marker_set.markers[m].name},
         {"bone", subject.marker_set.skeleton.bones[static_cast<std::size_t>(subject.marker_set.markers[m].bone)].name},
         {"residual_mm", 1e3 * subject.marker_residuals_m[m]}});
  }
  return {{"name", subject.name}, {"marker_set", subject.marker_set.name},   {"fitted_on", subject.fitted_on},
          {"size", subject.size}, {"residual_mm", 1e3 * subject.residual_m}, {"bones", bones},
          {"markers", markers}};
}

// Lengths are from the parent's joint to the bone's own; a residual of 0 was not told.
void print(const settings::SubjectFile& subject) {
  fmt::print("subject {}: {} markers of {}, size {:.3f}, residual {:.1f} mm, fitted {}\n\n", subject.name,
             subject.marker_set.markers.size(), subject.marker_set.name, subject.size, 1e3 * subject.residual_m,
             subject.fitted_on.empty() ? "at a date that nobody told" : subject.fitted_on);
  fmt::print("{:<16} {:<16} {:>9} {:>12}\n", "bone", "hangs on", "length mm", "residual mm");
  const auto& bones = subject.marker_set.skeleton.bones;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const bool root = bones[b].parent < 0;
    fmt::print("{:<16} {:<16} {:>9} {:>12.1f}\n", bones[b].name,
               root ? "" : bones[static_cast<std::size_t>(bones[b].parent)].name,
               root ? "" : fmt::format("{:.1f}", 1e3 * bones[b].rest_offset_m.norm()),
               1e3 * subject.bone_residuals_m[b]);
  }
  fmt::print("\n{:<16} {:<16} {:>9} {:>12}\n", "marker", "sits on", "mm off it", "residual mm");
  for (std::size_t m = 0; m < subject.marker_set.markers.size(); ++m) {
    const MarkerOnBone& marker = subject.marker_set.markers[m];
    fmt::print("{:<16} {:<16} {:>9.1f} {:>12.1f}\n", marker.name, bones[static_cast<std::size_t>(marker.bone)].name,
               1e3 * marker.offset_m.norm(), 1e3 * subject.marker_residuals_m[m]);
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

// Nothing, with words, where the takes tell too little.
std::optional<bodyfit::FittedSubject> fit_body(const MarkerSet& set, const bodyfit::LabelledTake& at_rest,
                                               const bodyfit::LabelledTake& moving) {
  const auto fitted = bodyfit::fit_subject(set, at_rest, moving, {});
  if (!fitted) {
    say("{} frames at rest and {} moving show too few of the {} markers of '{}' to fit a body to", at_rest.frames(),
        moving.frames(), set.markers.size(), set.name);
    return std::nullopt;
  }
  if (!fitted->from_rest && set.skeleton.bones.size() > 1) {
    say("no T-pose or A-pose told how the bones' frames lie: rotations are as the marker set has its markers");
  }
  return *fitted;
}

int exit_of(const Error& error) {
  say("{}", error.message);
  return error.code == ErrorCode::Io ? kExitUnavailable : kExitData;
}

// `worn`: the marker set that was written, beside the subject file `out`.
void tell_import(const SubjectOptions& options, const scene::ImportedMarkerSet& imported, const MarkerSet& worn,
                 const settings::SubjectFile& subject, const fs::path& out) {
  std::vector<std::array<std::string, 2>> asymmetric;
  for (const auto& [one, other] : worn.asymmetric)
    asymmetric.push_back({worn.markers[one].name, worn.markers[other].name});
  if (options.json) {
    Json all = json_of(subject);
    all["unknown"] = imported.unknown;
    all["twice"] = imported.twice;
    all["ghosts"] = imported.ghosts;
    all["model_outputs"] = imported.model_outputs;
    all["asymmetric"] = asymmetric;
    all["marker_set_file"] = subject.marker_set_file.string();
    all["subject_file"] = out.string();
    fmt::print("{}\n", all.dump(2));
  } else {
    print(subject);
    fmt::print("\n{} nameless points and {} outputs of models left out\n", imported.ghosts, imported.model_outputs);
    for (const auto& [one, other] : asymmetric)
      fmt::print("{} and {} are no mirror images of each other seen from the front: they tell the sides\n", one, other);
    fmt::print("written: {} and {}\n", subject.marker_set_file.string(), out.string());
  }
}

}  // namespace

int run_import(const SubjectOptions& options) {
  const std::optional<fs::path> skeleton_file =
      options.skeleton.empty() ? usual_skeleton() : std::optional(options.skeleton);
  if (!skeleton_file) {
    say("no config/skeletons/human18.toml here or above, expected one; or say --skeleton FILE");
    return kExitConfig;
  }
  const auto skeleton = settings::load_skeleton(*skeleton_file);
  if (!skeleton) {
    say("{}", skeleton.error().message);
    return kExitConfig;
  }
  const auto c3d = read_c3d(options.file);
  if (!c3d) return exit_of(c3d.error());
  const auto imported = scene::import_marker_set(*c3d, *skeleton, options.name);
  if (!imported)
    return exit_of({imported.error().code, fmt::format("{}: {}", options.file.string(), imported.error().message)});

  for (const std::string& label : imported->unknown)
    say("label '{}' follows no convention that is known; left out", label);
  for (const std::string& label : imported->twice) say("label '{}' is there twice; the first counts", label);

  const bodyfit::LabelledTake take = scene::take_of(*c3d, imported->marker_set);
  const auto fitted = fit_body(imported->marker_set, options.at_rest ? take : bodyfit::LabelledTake{},
                               options.at_rest ? bodyfit::LabelledTake{} : take);
  const MarkerSet worn = fitted ? identify::with_asymmetries(imported->marker_set, *fitted) : imported->marker_set;
  std::error_code failed;
  fs::create_directories(options.out, failed);
  const fs::path marker_set = options.out / (options.name + ".markers.toml");
  const fs::path out = options.out / (options.name + ".subject.toml");
  const Status set_saved = settings::save_marker_set(marker_set, worn, *skeleton_file);
  if (!set_saved) return exit_of(set_saved.error());
  if (!fitted) return kExitData;
  const settings::SubjectFile subject = file_of(*fitted, options, marker_set);
  const Status saved = settings::save_subject(out, subject);
  if (!saved) return exit_of(saved.error());
  tell_import(options, *imported, worn, subject, out);
  return kExitOk;
}

int run_fit(const SubjectOptions& options) {
  if (options.stream.empty() == options.c3d.empty() && (options.rest.empty() || !options.stream.empty())) {
    say("expected a recording: one of --stream FILE.jsonl and --c3d FILE.c3d, or --rest FILE.c3d alone");
    return kExitUsage;
  }
  const auto set = settings::load_marker_set(options.marker_set);
  if (!set) {
    say("{}", set.error().message);
    return kExitConfig;
  }
  StreamTakes takes;
  takes.at_rest.markers = takes.moving.markers = set->markers.size();
  if (!options.stream.empty()) {
    auto read = read_stream(options.stream, options.subject, *set, options.rest_s);
    if (!read) return exit_of(read.error());
    takes = *std::move(read);
  }
  for (const auto& [path, take] : {std::pair{options.c3d, &takes.moving}, {options.rest, &takes.at_rest}}) {
    if (path.empty()) continue;
    const auto c3d = read_c3d(path);
    if (!c3d) return exit_of(c3d.error());
    *take = scene::take_of(*c3d, *set);
  }
  const auto fitted = fit_body(*set, takes.at_rest, takes.moving);
  if (!fitted) return kExitData;
  const settings::SubjectFile subject = file_of(*fitted, options, options.marker_set);
  const Status saved = settings::save_subject(options.out, subject);
  if (!saved) return exit_of(saved.error());
  if (options.json) {
    fmt::print("{}\n", json_of(subject).dump(2));
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
    return kExitConfig;
  }
  if (options.json) {
    fmt::print("{}\n", json_of(*subject).dump(2));
  } else {
    print(*subject);
  }
  return kExitOk;
}

void add_subject_command(cli::App& app, SubjectOptions& options) {
  cli::App* subject = app.add_subcommand("subject", "bodies: import, fit, show");
  subject->require_subcommand(1);

  cli::App* import = subject->add_subcommand(
      "import", "make a marker set of a C3D file's labels, with the pairs that tell the sides, and fit the body");
  import->add_option("file", options.file, "a C3D file")->required()->type_name("FILE.c3d");
  import->add_option("--name", options.name, "of the subject and its marker set")->required();
  import->add_flag("--static", options.at_rest, "it is a static trial: somebody stands in T-pose or A-pose");
  import->add_option("--skeleton", options.skeleton, "default: config/skeletons/human18.toml here or above")
      ->type_name("FILE");
  import->add_option("--out", options.out, "folder that gets NAME.markers.toml and NAME.subject.toml")
      ->required()
      ->type_name("DIR");
  import->callback([&options] { options.run = run_import;
});

cli::App* fit = subject->add_subcommand("fit", "fit a body to a recording whose markers have names");
fit->add_option("--stream", options.stream, "a recorded feed, JSON lines")->type_name("FILE.jsonl");
fit->add_option("--c3d", options.c3d, "a C3D file")->type_name("FILE.c3d");
fit->add_option("--rest", options.rest, "a static trial of the same body")->type_name("FILE.c3d");
fit->add_option("--rest-s", options.rest_s, "seconds at the beginning of the feed that are a T-pose or A-pose")
    ->check(cli::Range(0.0, 600.0));
fit->add_option("--subject", options.subject, "which subject of the feed, from 0")->capture_default_str();
fit->add_option("--marker-set", options.marker_set, "what is worn")->required()->type_name("FILE.toml");
fit->add_option("--name", options.name, "of the subject; default: the name of the file that is written");
fit->add_option("--out", options.out, "the subject file to write")->required()->type_name("FILE.toml");
fit->callback([&options] { options.run = run_fit; });

cli::App* show = subject->add_subcommand("show", "a table of lengths, markers and residuals");
show->add_option("file", options.file, "a subject file")->required()->type_name("FILE.toml");
show->callback([&options] { options.run = run_show; });

for (cli::App* command : {import, fit, show}) command->add_flag("--json", options.json, "print JSON");
for (cli::App* command : {import, fit}) {
  command->add_option("--date", options.date, "that the file is to bear; default: now, UTC")->type_name("TEXT");
}
}  // namespace mocap::ctl

}  // namespace mocap::ctl
