#include "ctl/live_command.h"

#include <fmt/format.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>

#include "base/exit_codes.h"
#include "mocap/v1/control.pb.h"
#include "settings/subject_file.h"
#include "wire/control_codec.h"
#include "wire/zmq_control.h"

namespace mocap::ctl {
namespace {

constexpr int kExitData = 65;    // sysexits EX_DATAERR
constexpr int kExitNoPerm = 77;  // sysexits EX_NOPERM

int fail(const std::string& why, int code) {
  fmt::print(stderr, "mocapctl: {}\n", why);
  return code;
}

int exit_code_of(v1::Code code) {
  switch (code) {
    case v1::CODE_DONE: return kExitOk;
    case v1::CODE_FORBIDDEN: return kExitNoPerm;
    case v1::CODE_INVALID:
    case v1::CODE_NOT_FOUND: return kExitData;
    default: return kExitUnavailable;
  }
}

const char* word_of(v1::SubjectPhase phase, bool away) {
  if (away) return "away";
  switch (phase) {
    case v1::SUBJECT_PHASE_TRACKING: return "tracking";
    case v1::SUBJECT_PHASE_LOST: return "lost";
    default: return "searching";
  }
}

// "CAMERA_PHASE_STREAMING" as "streaming".
std::string word_of(v1::CameraPhase phase) {
  std::string word = v1::CameraPhase_Name(phase);
  word = word.substr(std::min(word.size(), std::string("CAMERA_PHASE_").size()));
  for (char& c : word) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return word;
}

void print_status(const v1::Status& status) {
  fmt::print("{}  session {}  capture {}  you are {}\n", status.producer(), status.session_id(),
             status.capturing() ? "runs" : "is stopped", status.role());
  for (const auto& subject : status.subjects()) {
    fmt::print("subject {:20} {}\n", subject.name(), word_of(subject.phase(), subject.away()));
  }
  if (!status.has_health()) return fmt::print("no report yet\n");
  const v1::Health& health = status.health();
  for (const auto& camera : health.cameras()) {
    fmt::print("camera  {:20} {:10} {:6.1f} Hz  frames {}  missing {}  {}{}\n", camera.name(), word_of(camera.phase()),
               camera.rate_hz(), camera.frames(), camera.missing_frames(), camera.last_error(),
               camera.bumped() ? fmt::format("stands otherwise than the rig says: {:.1f} px off", camera.rig_off_px())
                               : std::string());
  }
  fmt::print("sets    {:.1f}/s, complete {} of {}\n", health.set_rate_hz(), health.complete_sets(), health.sets());
  const v1::FeedHealth& feed = health.feed();
  fmt::print("feed    listeners {}  behind {}  refused {}  failed handshakes {}  cut off {}  sent {}\n",
             feed.listeners(), feed.behind(), feed.refused_clients(), feed.failed_handshakes(), feed.cut_off(),
             health.sent_snapshots());
}

void print_json(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  if (google::protobuf::util::MessageToJsonString(message, &text, options).ok()) fmt::print("{}\n", text);
}

void print(const v1::Answer& answer, bool json) {
  if (json) return print_json(answer);
  if (answer.has_status()) return print_status(answer.status());
  if (answer.has_description()) return print_json(answer.description());
  if (answer.has_snapshot()) return print_json(answer.snapshot());
  if (answer.code() == v1::CODE_DONE) fmt::print("{}\n", answer.message());
}

// A public key, or the file of one; empty for none.
Result<std::string> key_of(const std::string& text) {
  if (text.empty() || wire::is_key(text)) return text;
  return wire::load_public_key(text);
}

int ask(const LiveOptions& options, const ControlRequest& request) {
  wire::ControlClient::Settings settings;
  settings.endpoint = options.endpoint;
  const Result<std::string> server_key = key_of(options.server_key);
  if (!server_key) return fail(server_key.error().message, kExitData);
  settings.server_key = *server_key;
  if (settings.server_key.empty() != options.key.empty()) {
    return fail("--server-key and --key go together: the daemon's public key, and your own pair", kExitUsage);
  }
  if (!options.key.empty()) {
    Result<wire::KeyPair> own = wire::load_key_pair(options.key);
    if (!own) return fail(own.error().message, kExitData);
    settings.own_key = *own;
  }
  auto client = wire::ControlClient::open(settings);
  if (!client) return fail(client.error().message, kExitUsage);
  v1::Request message = wire::encode(request);
  message.set_id(1);
  const Result<std::string> came = (*client)->ask(message.SerializeAsString(), from_s(options.timeout_s));
  if (!came) return fail(came.error().message, kExitUnavailable);
  v1::Answer answer;
  if (!answer.ParseFromString(*came)) return fail("the answer is none of mocap.v1", kExitData);
  print(answer, options.json);
  if (answer.code() != v1::CODE_DONE && !options.json) fmt::print(stderr, "mocapctl: {}\n", answer.message());
  return exit_code_of(answer.code());
}

int fit(LiveOptions& options) {
  const auto body = settings::load_subject(options.subject_file);
  if (!body) return fail(settings::to_text(body.error()), kExitConfig);
  for (const Bone& bone : body->marker_set.skeleton.bones) options.request.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const auto& marker : body->marker_set.markers) options.request.marker_offsets_m.push_back(marker.offset_m);
  options.request.residual_m = body->residual_m;
  return ask(options, options.request);
}

void tell_connection(cli::App& command, LiveOptions& options) {
  command.add_option("--endpoint", options.endpoint, "the daemon's control endpoint")->capture_default_str();
  command.add_option("--server-key", options.server_key, "the daemon's public key, or the file of it")
      ->type_name("KEY|FILE");
  command.add_option("--key", options.key, "your own pair of keys")->type_name("FILE");
  command.add_option("--timeout-s", options.timeout_s, "how long to wait for the answer")
      ->check(cli::Range(0.1, 600.0))
      ->capture_default_str();
  command.add_flag("--json", options.json, "print the answer as JSON");
}

cli::App* add(cli::App& parent, const char* name, const char* what, ControlAction action, LiveOptions& options) {
  cli::App* command = parent.add_subcommand(name, what);
  tell_connection(*command, options);
  command->callback([&options, action] {
    options.request.action = action;
    options.run = [&options] { return ask(options, options.request); };
  });
  return command;
}

void add_cameras(cli::App& app, LiveOptions& options) {
  cli::App* camera = app.add_subcommand("camera", "settings of a camera that runs");
  camera->require_subcommand(1);
  cli::App* set = camera->add_subcommand("set", "exposure and gain, until the daemon is started again");
  tell_connection(*set, options);
  set->add_option("name", options.request.name, "of the camera")->required();
  auto* exposure = set->add_option("--exposure-us", options.exposure_us, "us")->check(cli::Range(1.0, 1e6));
  auto* gain = set->add_option("--gain-db", options.gain_db, "dB")->check(cli::Range(0.0, 60.0));
  set->callback([&options, exposure, gain] {
    options.request.action = ControlAction::AdjustCamera;
    if (*exposure) options.request.exposure_us = options.exposure_us;
    if (*gain) options.request.gain_db = options.gain_db;
    options.run = [&options] { return ask(options, options.request); };
  });
  cli::App* mask = app.add_subcommand("mask", "what shines in the empty volume");
  mask->require_subcommand(1);
  cli::App* learn = add(*mask, "learn", "look at the empty volume, mask what shines, keep it in the rig and start anew",
                        ControlAction::LearnMask, options);
  learn->add_option("--camera", options.request.name, "this one alone");
  learn->add_option("--images", options.request.images, "of each camera; default 100")->check(cli::Range(10, 10000));
}

}  // namespace

void add_live_commands(cli::App& app, LiveOptions& options) {
  add(app, "status", "how the daemon is", ControlAction::GetStatus, options);
  add(app, "description", "cameras, subjects, bones, markers", ControlAction::GetDescription, options);
  add(app, "snapshot", "the next snapshot, as JSON", ControlAction::GetSnapshot, options);
  add(app, "reload", "read the configuration anew, and start anew with it if it is good", ControlAction::Reload,
      options);
  cli::App* capture = app.add_subcommand("capture", "the cameras of the running daemon");
  capture->require_subcommand(1);
  add(*capture, "start", "let them run", ControlAction::StartCapture, options);
  add(*capture, "stop", "let them rest; feed and subjects stay", ControlAction::StopCapture, options);

  cli::App& subject = *app.get_subcommand("subject");
  const struct {
    const char *name, *what;
    ControlAction action;
  } subjects[] = {
      {"add", "look for a subject again, or for a new one (running daemon)", ControlAction::AddSubject},
      {"remove", "a subject is away: do not look for it (running daemon)", ControlAction::RemoveSubject},
      {"reset", "forget a subject's place and measures; the next T-pose or A-pose tells (running daemon)",
       ControlAction::ResetSubject},
      {"wear", "a subject measures as this file says from now on (running daemon)", ControlAction::FitSubject}};
  for (const auto& [name, what, action] : subjects) {
    cli::App* command = add(subject, name, what, action, options);
    command->add_option("name", options.request.name, "of the subject, as the configuration has it")->required();
    if (action == ControlAction::AddSubject) {
      command
          ->add_option("--marker-set", options.request.marker_set,
                       "a new subject wears this; kept in the daemon's configuration, and the daemon starts anew")
          ->type_name("FILE.toml")
          ->check(cli::ExistingFile{})
          ->transform(
              [](const std::string& file) { return std::filesystem::absolute(file).lexically_normal().string(); });
    }
    if (action != ControlAction::FitSubject) continue;
    command->add_option("file", options.subject_file, "of mocapctl subject fit")->required()->type_name("FILE.toml");
    command->callback([&options] {
      options.request.action = ControlAction::FitSubject;
      options.run = [&options] { return fit(options); };
    });
  }
  add_cameras(app, options);
}

namespace {

// The words that may follow a row of commands.
void print_words(const cli::App& app, const std::string& row) {
  std::string words;
  for (const cli::App* command : app.subcommands()) {
    words += command->get_name() + ' ';
  }
  for (const std::string& name : app.option_names()) words += "--" + name + ' ';
  fmt::print("    '{}') words='{}' ;;\n", row, words);
  for (const cli::App* command : app.subcommands()) {
    print_words(*command, row + ' ' + command->get_name());
  }
}

int print_completion(const cli::App& app) {
  fmt::print(R"(# bash completion of mocapctl; source it, or put it into /etc/bash_completion.d
_mocapctl() {{
  local row=mocapctl word words= i
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${{COMP_WORDS[i]}}
    [[ $word == -* ]] && break
    row="$row $word"
  done
  case "$row" in
)");
  print_words(app, "mocapctl");
  fmt::print(R"(  esac
  if [[ -n $words ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words" -- "${{COMP_WORDS[COMP_CWORD]}}")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "${{COMP_WORDS[COMP_CWORD]}}")
  fi
}}
complete -o bashdefault -F _mocapctl mocapctl
)");
  return kExitOk;
}

}  // namespace

void add_completion_command(cli::App& app, std::function<int()>& run) {
  cli::App* completion = app.add_subcommand("completion", "print what bash needs: source <(mocapctl completion)");
  completion->callback([&app, &run] { run = [&app] { return print_completion(app); }; });
}

}  // namespace mocap::ctl
