#include "ctl/live/live_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <iomanip>
#include <sstream>

#include "base/exit_codes.h"
#include "base/read_file.h"
#include "ctl/live/live_answer.h"
#include "ctl/live/live_connection.h"
#include "ctl/live/mask_command.h"
#include "mocap/v1/control.pb.h"
#include "settings/shipped_files.h"
#include "settings/subject/subject_file.h"
#include "take/recorder/shot_list.h"

namespace mocap::ctl {
namespace {

// A take ends when the disk has all of it.
constexpr double kTakePatience_s = 35.0;

int fail(const std::string& why, int code) {
  fmt::print(stderr, "mocapctl: {}\n", why);
  return code;
}

int ask(const LiveOptions& options, const ControlRequest& request) {
  auto client = connect(options);
  if (!client) return fail(client.error().message, client.error().exit);
  const auto answer = ask_once(**client, request, options.timeout_s);
  if (!answer) return fail(answer.error().message, answer.error().exit);
  print_answer(*answer, options.json, options.csv);
  if (answer->code() != v1::CODE_DONE && !options.json) fmt::print(stderr, "mocapctl: {}\n", answer->message());
  return exit_code_of(answer->code());
}

// Seconds since 1970 of "2026-03-01T12:00:00Z" or of the next "12:00:00", both UTC.
std::optional<std::int64_t> utc_ns_of(const std::string& text) {
  std::tm when{};
  std::istringstream date(text);
  date >> std::get_time(&when, "%Y-%m-%dT%H:%M:%SZ");
  if (date && date.peek() == std::istringstream::traits_type::eof()) return ::timegm(&when) * 1'000'000'000LL;
  const std::time_t now = std::time(nullptr);
  ::gmtime_r(&now, &when);
  std::istringstream time(text);
  time >> std::get_time(&when, "%H:%M:%S");
  if (!time || time.peek() != std::istringstream::traits_type::eof()) return std::nullopt;
  const std::time_t today = ::timegm(&when);
  return (today > now ? today : today + 86400) * 1'000'000'000LL;
}

// "12:34:56:10", or with ; or . before the frames. The rate is that of the daemon.
std::optional<Timecode> timecode_in(const std::string& text) {
  Timecode any;
  any.frames_per_second = 100;  // two digits; the daemon knows the rate and checks the frames
  return parse_timecode(text, any);
}

int order_take(LiveOptions& options) {
  TakeOrder& order = options.request.take;
  order.before = from_s(options.before_s);
  order.length = from_s(options.seconds);
  order.countdown = from_s(options.countdown_s);
  if (!options.at.empty()) {
    order.at_timecode = timecode_in(options.at);
    const auto at = utc_ns_of(options.at);
    if (!at && !order.at_timecode) {
      return fail(
          fmt::format("--at is '{}', expected 12:34:56 or 2026-03-01T12:34:56Z, both UTC, or the timecode 12:34:56:10",
                      options.at),
          kExitUsage);
    }
    order.at_utc_ns = at.value_or(0);
  }
  return ask(options, options.request);
}

int import_shots(LiveOptions& options) {
  const Result<std::string> text = read_file(options.shots_file);
  if (!text) return fail(text.error().message, kExitNoInput);
  auto shots = take::parse_shots(*text, options.shots_file.string());
  if (!shots) return fail(shots.error().message, kExitData);
  if (shots->empty())
    return fail(fmt::format("'{}' has no shot below its header", options.shots_file.string()), kExitData);
  options.request.take.shots = *std::move(shots);
  return ask(options, options.request);
}

int fit(LiveOptions& options) {
  const auto body = settings::load_subject(options.subject_file);
  if (!body) return fail(settings::to_text(body.error()), kExitConfig);
  for (const Bone& bone : body->marker_set.skeleton.bones) options.request.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const auto& marker : body->marker_set.markers) options.request.marker_offsets_m.push_back(marker.offset_m);
  options.request.residual_m = body->residual_m;
  return ask(options, options.request);
}

// `example`: the command line after "mocapctl ".
cli::App* add(cli::App& parent, const char* name, const char* what, const char* example, ControlAction action,
              LiveOptions& options) {
  cli::App* command = parent.add_subcommand(name, what);
  command->examples(fmt::format(
      "  mocapctl {0}\n  mocapctl {0} --endpoint tcp://10.0.0.7:5571 --server-key server.key --secret-key anna.key",
      example));
  add_connection_options(*command, options);
  command->callback([&options, action] {
    options.request.action = action;
    options.run = [&options] { return ask(options, options.request); };
  });
  return command;
}

void add_take_times(cli::App& command, LiveOptions& options) {
  command.add_option("--slate", options.request.take.slate, "what is recorded; the takes are numbered within it");
  command.add_option("--notes", options.request.take.text, "notes for the take");
  command
      .add_option("--before", options.before_s,
                  "pre-roll: the take begins this many seconds before its start time; see [takes] before_s")
      ->check(cli::Range(0.0, 600.0));
  command.add_option("--seconds", options.seconds, "the take ends after this time; default: at take stop")
      ->check(cli::Range(0.0, 604800.0));
  command.add_option("--countdown", options.countdown_s, "the take starts after so many seconds")
      ->check(cli::Range(0.0, 604800.0));
  command.add_option("--at", options.at, "the take starts at this time, UTC, or at this timecode")
      ->type_name("HH:MM:SS[:FF]");
}

void add_takes(cli::App& app, LiveOptions& options) {
  cli::App& take = *app.get_subcommand("take");
  const struct {
    const char *name, *what, *example;
    TakeAction action;
  } commands[] = {
      {"start", "start a take (running daemon)", "take start walk --before 20 --seconds 60", TakeAction::Start},
      {"stop", "end the take; returns when its file is on the disk (running daemon)", "take stop", TakeAction::Stop},
      {"cancel", "end the take and delete its file (running daemon)", "take cancel", TakeAction::Cancel},
      {"mark", "mark this instant in the take (running daemon)", "take mark 'prop fell'", TakeAction::Mark},
      {"next", "end the take, if any, and start the next one: of the shot list, or of its slate (running daemon)",
       "take next", TakeAction::Next}};
  for (const auto& [name, what, example, action] : commands) {
    cli::App* command = add(take, name, what, example, ControlAction::Take, options);
    if (action == TakeAction::Start) {
      command->add_option("name", options.request.take.name, "name of the take; default: by [takes] name");
    }
    if (action == TakeAction::Start || action == TakeAction::Next) add_take_times(*command, options);
    if (action == TakeAction::Mark) command->add_option("text", options.request.take.text, "what happened");
    command->callback([&options, action = action] {
      options.request.action = ControlAction::Take;
      options.request.take.action = action;
      options.timeout_s = std::max(options.timeout_s, kTakePatience_s);
      options.run = [&options] { return order_take(options); };
    });
  }
}

void add_shots(cli::App& app, LiveOptions& options) {
  cli::App* shots = app.get_subcommand("take")->add_subcommand("shots", "the shot list, which take next follows");
  shots->examples(
      "  mocapctl take shots import day1.csv\n"
      "  mocapctl take shots list");
  shots->require_subcommand(1);
  cli::App* importing =
      add(*shots, "import", "replace the shot list by a CSV file: name,slate,notes,seconds (running daemon)",
          "take shots import day1.csv", ControlAction::Take, options);
  importing->add_option("file", options.shots_file, "header name,slate,notes,seconds; only name is needed")
      ->required()
      ->type_name("FILE.csv");
  importing->callback([&options] {
    options.request.action = ControlAction::Take;
    options.request.take.action = TakeAction::ImportShots;
    options.run = [&options] { return import_shots(options); };
  });
  cli::App* list = add(*shots, "list", "the shots, with those that were taken (running daemon)", "take shots list",
                       ControlAction::GetShots, options);
  list->add_flag("--csv", options.csv, "print the list as a file for import");
  cli::App* clear =
      add(*shots, "clear", "empty the shot list (running daemon)", "take shots clear", ControlAction::Take, options);
  clear->callback([&options] {
    options.request.action = ControlAction::Take;
    options.request.take.action = TakeAction::ClearShots;
    options.run = [&options] { return ask(options, options.request); };
  });
}

void add_cameras(cli::App& app, LiveOptions& options) {
  cli::App* camera = app.add_subcommand("camera", "settings of a running camera");
  camera->examples("  mocapctl camera set north-east --exposure-us 800 --gain-db 6");
  camera->require_subcommand(1);
  cli::App* set = camera->add_subcommand("set", "set exposure and gain until the next start of the daemon");
  set->examples(
      "  mocapctl camera set north-east --exposure-us 800\n"
      "  mocapctl camera set north-east --gain-db 6");
  add_connection_options(*set, options);
  set->add_option("name", options.request.name, "name of the camera")->required();
  auto* exposure = set->add_option("--exposure-us", options.exposure_us, "us")->check(cli::Range(1.0, 1e6));
  auto* gain = set->add_option("--gain-db", options.gain_db, "dB")->check(cli::Range(0.0, 60.0));
  set->callback([&options, exposure, gain] {
    options.request.action = ControlAction::AdjustCamera;
    if (*exposure) options.request.exposure_us = options.exposure_us;
    if (*gain) options.request.gain_db = options.gain_db;
    options.run = [&options] { return ask(options, options.request); };
  });
}

}  // namespace

void add_live_commands(cli::App& app, LiveOptions& options) {
  add(app, "status", "state of the daemon", "status", ControlAction::GetStatus, options);
  add(app, "description", "cameras, subjects, bones, markers", "description", ControlAction::GetDescription, options);
  add(app, "snapshot", "the next snapshot, as JSON", "snapshot", ControlAction::GetSnapshot, options);
  add(app, "reload", "read the configuration again, and use it if it is valid; what is unchanged goes on", "reload",
      ControlAction::Reload, options);
  cli::App* capture = app.add_subcommand("capture", "the cameras of the running daemon");
  capture->examples(
      "  mocapctl capture stop\n"
      "  mocapctl capture start");
  capture->require_subcommand(1);
  add(*capture, "start", "start all cameras", "capture start", ControlAction::StartCapture, options);
  add(*capture, "stop", "stop all cameras; feed and subjects stay", "capture stop", ControlAction::StopCapture,
      options);

  cli::App& subject = *app.get_subcommand("subject");
  const struct {
    const char *name, *what, *example;
    ControlAction action;
  } subjects[] = {
      {"add", "search for a subject again, or for a new subject (running daemon)",
       "subject add anna --marker-set markersets/baseline41.toml", ControlAction::AddSubject},
      {"remove", "a subject is absent: do not search for it (running daemon)", "subject remove anna",
       ControlAction::RemoveSubject},
      {"reset", "discard a subject's pose and body; the next T-pose or A-pose measures both again (running daemon)",
       "subject reset anna", ControlAction::ResetSubject},
      {"wear", "use the body of this subject file from now on (running daemon)", "subject wear anna anna.toml",
       ControlAction::FitSubject}};
  for (const auto& [name, what, example, action] : subjects) {
    cli::App* command = add(subject, name, what, example, action, options);
    command->add_option("name", options.request.name, "name of the subject, as in the configuration")->required();
    if (action == ControlAction::AddSubject) {
      command
          ->add_option("--marker-set", options.request.marker_set,
                       "marker set of a new subject; is added to the daemon's configuration")
          ->type_name("FILE.toml")
          ->check(cli::ExistingFile{})
          ->transform([](const std::string& file) {
            return std::filesystem::absolute(settings::find_shipped(file, {}).path).lexically_normal().string();
          });
    }
    if (action != ControlAction::FitSubject) continue;
    command->add_option("file", options.subject_file, "subject file of mocapctl subject fit")
        ->required()
        ->type_name("FILE.toml");
    command->callback([&options] {
      options.request.action = ControlAction::FitSubject;
      options.run = [&options] { return fit(options); };
    });
  }
  add_cameras(app, options);
  add_mask_command(app, options);
  add_takes(app, options);
  add_shots(app, options);
}

}  // namespace mocap::ctl
