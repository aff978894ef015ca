#include "ctl/take/take_command.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "base/exit_codes.h"
#include "ctl/json_line.h"
#include "ctl/take/take_failure.h"
#include "lib/cli/shown_text.h"
#include "lib/takes/take_report.h"
#include "take/take_edit.h"
#include "take/take_reader.h"

namespace mocap::ctl {
namespace {

using nlohmann::ordered_json;

int fail(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", cli::shown_lines(error.message));
  switch (error.code) {
    case ErrorCode::NotFound: return kExitNoInput;
    case ErrorCode::InvalidArgument:
    case ErrorCode::Unsupported: return kExitData;
    case ErrorCode::Io: return kExitCannotWrite;
    default: return kExitUnavailable;
  }
}

// Runs `command` for each file, all of them. Returns the exit code of the first failure.
int for_each_file(const TakeOptions& options, const std::function<int(const std::filesystem::path&)>& command) {
  int code = kExitOk;
  for (const std::filesystem::path& file : options.files) {
    const int ended = command(file);
    if (code == kExitOk) code = ended;
  }
  return code;
}

// A number or text of untrusted metadata; nothing if it is of another kind. A text has no control characters.
double number_in(const ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string text_in(const ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? cli::shown(found->get<std::string>()) : std::string();
}

void print_markers(const ordered_json& subject) {
  const auto markers = subject.find("markers");
  if (markers == subject.end() || !markers->is_object()) return;
  for (const auto& [name, marker] : markers->items()) {
    if (!marker.is_object()) continue;
    fmt::print("    {:20} seen {:5.1f} %  filled {:5.1f} %  lost {:5.1f} %  longest gap {:.2f} s\n", cli::shown(name),
               number_in(marker, "seen"), number_in(marker, "filled"), number_in(marker, "lost"),
               number_in(marker, "longest_gap_s"));
  }
}

void print_quality(const ordered_json& quality) {
  fmt::print("  quality: {}\n", text_in(quality, "quality"));
  for (const auto& reason : quality.value("reasons", ordered_json::array())) {
    if (reason.is_string()) fmt::print("    {}\n", cli::shown(reason.get<std::string>()));
  }
  fmt::print("  sets {:.0f}, lost {:.0f}; images lost {:.0f}; residual {:.2f} px; longest gap {:.2f} s\n",
             number_in(quality, "sets"), number_in(quality, "lost_sets"), number_in(quality, "lost_images"),
             number_in(quality, "residual_px"), number_in(quality, "longest_gap_s"));
  const ordered_json cameras = quality.value("cameras", ordered_json::object());
  for (const auto& [name, share] : cameras.items()) {
    if (share.is_number())
      fmt::print("  camera {:18} in {:5.1f} % of the sets\n", cli::shown(name), share.get<double>());
  }
  for (const auto& subject : quality.value("subjects", ordered_json::array())) {
    if (!subject.is_object()) continue;
    fmt::print("  subject {:17} tracked {:5.1f} %  label changes {:.0f}  residual {:.1f} mm\n",
               text_in(subject, "name"), number_in(subject, "tracked"), number_in(subject, "label_changes"),
               number_in(subject, "residual_mm"));
    print_markers(subject);
  }
}

void print_text(const take::TakeReader& reader) {
  const take::TakeInfo& info = reader.info();
  const double seconds = takes::seconds_of(reader);
  const ordered_json quality = takes::quality_of(reader);
  const auto bytes = static_cast<double>(reader.mcap().file().size());
  fmt::print("{}\n", cli::shown(reader.mcap().path()));
  fmt::print("  {}, {:.3f} s, {:.1f} MB, {:.2f} MB/s\n", takes::state_of(reader), seconds, 1e-6 * bytes,
             seconds > 0.0 ? 1e-6 * bytes / seconds : 0.0);
  print_quality(quality);
  for (const auto& [topic, count] : reader.counts()) {
    fmt::print("  {:24} {:8} messages {:8.1f} Hz\n", cli::shown(topic), count,
               seconds > 0.0 ? static_cast<double>(count) / seconds : 0.0);
  }
  for (const std::string& file : reader.files()) fmt::print("  file {}\n", cli::shown(file));
  for (const auto& [key, value] : take::encode(info).texts) {
    if (!value.empty() && !key.starts_with("quality")) fmt::print("  {:18} {}\n", cli::shown(key), cli::shown(value));
  }
  for (const auto& damage : reader.mcap().damages()) fmt::print("  damaged: {}\n", cli::shown(damage.what));
  if (reader.cut_off() && !reader.is_being_written()) {
    fmt::print("  write its index with: mocapctl take repair {}\n", cli::shown(reader.mcap().path()));
  }
}

int run_show(const TakeOptions& options) {
  return for_each_file(options, [&](const std::filesystem::path& file) {
    const auto reader = take::TakeReader::open(file);
    if (!reader) return fail(cannot_read(reader.error()));
    if (options.json) {
      fmt::print("{}\n", json_line(takes::json_of(*reader)));
    } else {
      print_text(*reader);
    }
    return static_cast<int>(kExitOk);
  });
}

int run_list(const TakeOptions& options) {
  int code = kExitOk;
  for (const std::filesystem::path& file : takes::takes_in(options.files)) {
    const auto reader = take::TakeReader::open(file);
    if (!reader) {
      code = fail(cannot_read(reader.error()));
    } else if (options.json) {
      fmt::print("{}\n", json_line(takes::json_of(*reader)));
    } else {
      const take::TakeInfo& info = reader->info();
      fmt::print("{:32} {:10} {:9.2f} s {:9.1f} MB  {}  {} {}\n", cli::shown(file.string()), takes::state_of(*reader),
                 takes::seconds_of(*reader), 1e-6 * static_cast<double>(reader->mcap().file().size()),
                 info.rating ? fmt::format("{}/{}", *info.rating, take::kMaxRating) : "-/5", cli::shown(info.slate),
                 cli::shown(info.notes));
    }
  }
  return code;
}

int run_verify(const TakeOptions& options) {
  return for_each_file(options, [&](const std::filesystem::path& file) {
    const auto faults = take::verify_take(file);
    if (!faults) return fail(cannot_read(faults.error()));
    if (options.json) {
      ordered_json json{{"file", file.string()}, {"valid", faults->empty()}, {"faults", ordered_json::array()}};
      for (const auto& fault : *faults) json["faults"].push_back(fault.what);
      fmt::print("{}\n", json_line(json));
    } else if (faults->empty()) {
      fmt::print("{}: valid\n", cli::shown(file.string()));
    } else {
      for (const auto& fault : *faults) fmt::print("{}: {}\n", cli::shown(file.string()), cli::shown(fault.what));
    }
    return static_cast<int>(faults->empty() ? kExitOk : kExitData);
  });
}

int run_repair(const TakeOptions& options) {
  return for_each_file(options, [&](const std::filesystem::path& file) {
    const auto repair = take::repair_take(file);
    if (!repair) return fail(repair.error());
    if (options.json) {
      ordered_json json{{"file", file.string()}, {"messages", repair->messages}, {"lost_bytes", repair->lost_bytes}};
      fmt::print("{}\n", json_line(json));
      return static_cast<int>(kExitOk);
    }
    fmt::print("{}: {} messages kept, {} damaged bytes left out, index written\n", cli::shown(file.string()),
               repair->messages, repair->lost_bytes);
    for (const auto& damage : repair->damages) fmt::print("  left out: {}\n", cli::shown(damage.what));
    return static_cast<int>(kExitOk);
  });
}

int run_edit(const TakeOptions& options, const take::TakeEdit& edit) {
  return for_each_file(options, [&](const std::filesystem::path& file) {
    const auto info = take::edit_take(file, edit);
    if (!info) return fail(info.error());
    fmt::print("{}: changed\n", cli::shown(file.string()));
    return static_cast<int>(kExitOk);
  });
}

int run_rename(const TakeOptions& options) {
  const auto renamed = takes::rename(options.file, options.text);
  if (!renamed) return fail(renamed.error());
  fmt::print("{}: now {}\n", cli::shown(options.file.string()), cli::shown(renamed->string()));
  return kExitOk;
}

bool is_confirmed(const std::filesystem::path& file) {
  if (::isatty(STDIN_FILENO) == 0) return false;
  fmt::print("delete {}? [y/N] ", cli::shown(file.string()));
  std::fflush(stdout);
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "yes";
}

int run_delete(const TakeOptions& options) {
  return for_each_file(options, [&](const std::filesystem::path& file) {
    const auto reader = take::TakeReader::open(file);
    if (!reader) return fail(cannot_read(reader.error()));
    if (reader->is_being_written()) {
      return fail({ErrorCode::Busy, fmt::format("'{}' is being recorded; stop the take first", file.string())});
    }
    if (!options.yes && !is_confirmed(file)) {
      return fail({ErrorCode::Busy, fmt::format("'{}' is kept; add --yes to delete it", file.string())});
    }
    std::error_code error;
    if (!std::filesystem::remove(file, error)) {
      return fail({ErrorCode::Io, fmt::format("'{}' cannot be deleted: {}", file.string(), error.message())});
    }
    fmt::print("{}: deleted\n", cli::shown(file.string()));
    return static_cast<int>(kExitOk);
  });
}

// `example`: the command line after "mocapctl take ".
cli::App* add(cli::App& parent, const char* name, const char* what, const char* example, TakeOptions& options,
              int (*run)(const TakeOptions&)) {
  cli::App* command = parent.add_subcommand(name, what);
  command->examples(fmt::format("  mocapctl take {} {}", name, example));
  command->callback([&options, run] { options.run = [&options, run] { return run(options); }; });
  return command;
}

void add_files(cli::App& command, TakeOptions& options) {
  command.add_option("file", options.files, "takes")->required()->type_name("FILE.mcap ...");
}

void add_json(cli::App& command, TakeOptions& options) {
  command.add_flag("--json", options.json, "print one line of JSON for each take");
}

// Commands with one text or number before the files.
void add_edits(cli::App& takes, TakeOptions& options) {
  cli::App* note = takes.add_subcommand("note", "replace the notes of takes");
  note->examples("  mocapctl take note 'second try, prop fell' walk-3.mcap");
  note->add_option("text", options.text, "the notes")->required();
  note->callback([&options] {
    options.run = [&options] {
      take::TakeEdit edit;
      edit.notes = options.text;
      return run_edit(options, edit);
    };
  });
  cli::App* rate = takes.add_subcommand("rate", "rate takes");
  rate->examples("  mocapctl take rate 5 walk-3.mcap");
  rate->add_option("rating", options.rating, "0: unusable, 5: the best")
      ->required()
      ->check(cli::Range(0, take::kMaxRating));
  rate->callback([&options] {
    options.run = [&options] {
      take::TakeEdit edit;
      edit.rating = options.rating;
      return run_edit(options, edit);
    };
  });
  for (cli::App* command : {note, rate}) add_files(*command, options);
}

}  // namespace

void add_take_command(cli::App& app, TakeOptions& options) {
  cli::App* commands = app.add_subcommand("take", "recorded takes: list, show, verify, repair, note, rename, delete");
  commands->examples(
      "  mocapctl take list takes\n"
      "  mocapctl take show takes/walk-3.mcap --json\n"
      "  mocapctl take repair takes/walk-3.mcap");
  commands->require_subcommand(1);
  cli::App* list = add(*commands, "list", "one line for each take", "takes", options, run_list);
  list->add_option("place", options.files, "folders and takes; default: this folder")->type_name("PATH ...");
  cli::App* show =
      add(*commands, "show", "quality, length, topics, rates, files, notes", "walk-3.mcap --json", options, run_show);
  cli::App* verify = add(*commands, "verify", "check every checksum and every message; exit code 65 if one is wrong",
                         "walk-3.mcap", options, run_verify);
  cli::App* repair = add(*commands, "repair", "write the index of a take that was cut off; leave out damaged parts",
                         "walk-3.mcap", options, run_repair);
  for (cli::App* command : {show, verify, repair}) add_files(*command, options);
  for (cli::App* command : {list, show, verify, repair}) add_json(*command, options);
  add_edits(*commands, options);
  cli::App* rename = add(*commands, "rename", "rename a take and its file; replaces no file", "walk-3.mcap walk-best",
                         options, run_rename);
  rename->add_option("file", options.file, "take")->required()->type_name("FILE.mcap");
  rename->add_option("name", options.text, "new name, without .mcap")->required();
  cli::App* remove = add(*commands, "delete", "delete takes", "walk-3.mcap --yes", options, run_delete);
  add_files(*remove, options);
  remove->add_flag("--yes", options.yes, "do not ask");
}

}  // namespace mocap::ctl
