#include "web/takes/take_site.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "web/query.h"
#include "web/takes/take_files.h"
#include "wire/endpoint.h"

namespace mocap::web {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

HttpReply json_reply(int status, const ordered_json& json) {
  return {status, "application/json", json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + '\n'};
}

// As an Answer of the control protocol.
HttpReply take_fault(int status, const char* code, const std::string& message) {
  return json_reply(status, {{"code", code}, {"message", message}});
}

HttpReply fault_of(const Error& error) {
  switch (error.code) {
    case ErrorCode::NotFound: return take_fault(404, "CODE_NOT_FOUND", error.message);
    case ErrorCode::InvalidArgument: return take_fault(400, "CODE_INVALID", error.message);
    case ErrorCode::Unsupported: return take_fault(422, "CODE_UNSUPPORTED", error.message);
    case ErrorCode::Busy: return take_fault(409, "CODE_FAILED", error.message);
    default: return take_fault(502, "CODE_FAILED", error.message);
  }
}

HttpReply busy() { return take_fault(503, "CODE_FAILED", "too many requests wait for the disk; try again"); }

HttpReply reply_of(const Result<ordered_json>& json) { return json ? json_reply(200, *json) : fault_of(json.error()); }

HttpReply reply_of(const Result<std::string>& sentence) {
  if (!sentence) return fault_of(sentence.error());
  return json_reply(200, {{"code", "CODE_DONE"}, {"message", *sentence}});
}

HttpReply reply_of_piece(Result<std::string> piece) {
  if (!piece) return fault_of(piece.error());
  return {200, "application/octet-stream", *std::move(piece)};
}

// A number of a query; `otherwise` if it is absent. Empty: not a number.
std::optional<double> number_of(const std::map<std::string, std::string>& query, const char* key, double otherwise) {
  const auto found = query.find(key);
  if (found == query.end()) return otherwise;
  double number = 0.0;
  const char* const end = found->second.data() + found->second.size();
  const auto [at, fault] = std::from_chars(found->second.data(), end, number);
  if (fault != std::errc() || at != end) return std::nullopt;
  return number;
}

// The options of `mocapctl take export` that a query may have. The command checks their values.
constexpr std::array<std::string_view, 6> kExportOptions = {"axes", "unit", "names", "fps", "fill", "subject"};

std::vector<std::string> export_options(const std::map<std::string, std::string>& query) {
  std::vector<std::string> options;
  for (const std::string_view name : kExportOptions) {
    const auto given = query.find(std::string(name));
    if (given != query.end() && !given->second.empty()) options.push_back(fmt::format("--{}={}", name, given->second));
  }
  return options;
}

std::string query_of(const std::map<std::string, std::string>& query) {
  std::string text;
  for (const std::string_view name : kExportOptions) {
    const auto given = query.find(std::string(name));
    if (given == query.end() || given->second.empty()) continue;
    text += fmt::format("{}{}={}", text.empty() ? '?' : '&', name, percent_encoded(given->second));
  }
  return text;
}

// The export of a take that was changed is another one.
std::string version_of(const fs::path& file) {
  std::error_code error;
  return fmt::format("{} {}", fs::file_size(file, error), fs::last_write_time(file, error).time_since_epoch().count());
}

// Empty: this process may read the take.
std::string obstacle_to(const fs::path& take) {
  if (!take.is_absolute()) return "the path is relative";
  std::error_code error;
  if (!fs::is_regular_file(take, error)) return error ? error.message() : "it is not a regular file";
  if (::access(take.c_str(), R_OK) != 0) return std::generic_category().message(errno);
  return {};
}

const char* name_of(ExportState state) {
  switch (state) {
    case ExportState::Waiting: return "waiting";
    case ExportState::Running: return "running";
    case ExportState::Done: return "done";
    case ExportState::Failed: return "failed";
  }
  return "failed";
}

}  // namespace

TakeSite::TakeSite(fs::path folder, std::string feed, RunHere run_here)
    : folder_(std::move(folder)),
      folder_given_(!folder_.empty()),
      feed_(std::move(feed)),
      run_here_(std::move(run_here)),
      exports_([](const ExportWish& wish, std::atomic<double>& progress,
                  const std::atomic<bool>& stopped) { return run_export(mocapctl_here(), wish, progress, stopped); },
               run_here_) {}

void TakeSite::note_take(const std::string& path) {
  if (folder_given_ || !wire::is_local(feed_)) return;
  reported_ = path;
  obstacle_ = path.empty() ? "" : obstacle_to(path);
  if (!path.empty() && obstacle_.empty()) folder_ = fs::path(path).parent_path();
}

std::string TakeSite::folder_unknown() const {
  if (!wire::is_local(feed_)) {
    return fmt::format(
        "the daemon at '{}' may be on another machine, so the folder of its takes is not known: start "
        "mocap-web with --takes FOLDER on the daemon's machine",
        feed_);
  }
  if (reported_.empty()) {
    return "the folder of the takes is not known: start mocap-web with --takes FOLDER on the daemon's machine, or "
           "record a take";
  }
  return fmt::format(
      "the daemon's take '{}' is not readable here: {}; start mocap-web with --takes FOLDER on the "
      "daemon's machine, as a user who may read the takes",
      reported_, obstacle_);
}

bool TakeSite::is_about_takes(std::string_view path) {
  if (path.starts_with(kTakesPath)) return true;
  return path.starts_with(kTakesApi) && (path.size() == kTakesApi.size() || path[kTakesApi.size()] == '/');
}

bool is_change_of_take(const HttpRequest& request) {
  const std::string_view path = request.path;
  if (!path.starts_with(kTakesApi)) return false;
  const std::size_t verb = path.find('/', kTakesApi.size() + 1);  // "/NAME/VERB": a name may be a verb, too
  return verb != std::string_view::npos && is_take_change(path.substr(verb + 1));
}

void TakeSite::reply_from(Worker& worker, std::function<HttpReply()> make, Done done) {
  const bool queued = worker.run([this, make = std::move(make), done] {
    run_here_([done, reply = make()]() mutable { done(std::move(reply)); });
  });
  if (!queued) done(busy());
}

void TakeSite::answer(const HttpRequest& request, Done done) {
  const auto query = read_query(request.query);
  if (!query) return done(take_fault(400, "CODE_INVALID", "the query has a broken escape"));
  if (folder_.empty()) return done(take_fault(404, "CODE_NOT_FOUND", folder_unknown()));
  if (request.path.starts_with(kTakesPath)) {
    const auto file_name = percent_decoded(std::string_view(request.path).substr(kTakesPath.size()));
    if (!file_name) return done(take_fault(400, "CODE_INVALID", "the path has a broken escape"));
    return answer_file(*file_name, *query, std::move(done));
  }
  std::string_view rest = std::string_view(request.path).substr(kTakesApi.size());
  if (rest.size() <= 1)
    return reply_from(
        quick_, [folder = folder_] { return reply_of(list_takes(folder)); }, done);
  rest.remove_prefix(1);
  const std::size_t slash = std::min(rest.find('/'), rest.size());
  const auto name = percent_decoded(rest.substr(0, slash));
  if (!name) return done(take_fault(400, "CODE_INVALID", "the path has a broken escape"));
  const std::string verb(rest.substr(std::min(slash + 1, rest.size())));
  answer_api(request, *name, verb, *query, std::move(done));
}

void TakeSite::answer_api(const HttpRequest& request, const std::string& name, const std::string& verb,
                          const Query& query, Done done) {
  const auto with_file = [&](Worker& worker, auto make) {
    reply_from(
        worker,
        [folder = folder_, name, make] {
          const Result<fs::path> file = take_file(folder, name);
          return file ? make(*file) : fault_of(file.error());
        },
        done);
  };
  if (is_take_change(verb)) {
    return with_file(
        quick_, [verb, body = request.body](const fs::path& file) { return reply_of(change_take(file, verb, body)); });
  }
  if (verb.empty()) return with_file(slow_, [](const fs::path& file) { return reply_of(show_take(file)); });
  if (verb == "verify") return with_file(slow_, [](const fs::path& file) { return reply_of(verify_take(file)); });
  if (verb == "export") {
    const auto format = query.find("format");
    return answer_export(name, format == query.end() ? "" : format->second, query, std::move(done));
  }
  if (verb != "snapshots") return done(take_fault(404, "CODE_NOT_FOUND", "there is no such method of a take"));
  const auto from_s = number_of(query, "from_s", 0.0), seconds = number_of(query, "seconds", 1.0);
  if (!from_s || !seconds || *from_s < 0.0 || !(*seconds > 0.0 && *seconds <= 10.0))
    return done(take_fault(400, "CODE_INVALID", "expected from_s of at least 0 and seconds above 0, at most 10"));
  with_file(quick_,
            [from_s, seconds](const fs::path& file) { return reply_of_piece(take_piece(file, *from_s, *seconds)); });
}

std::shared_ptr<ExportJob> TakeSite::wish_export(const std::string& name, const std::string& format, const Query& query,
                                                 HttpReply& refused) {
  const Result<fs::path> file = take_file(folder_, name);
  if (!file) {
    refused = fault_of(file.error());
    return nullptr;
  }
  const std::string key = fmt::format("{} {} {}{}", file->string(), version_of(*file), format, query_of(query));
  auto job = exports_.wish(key, {*file, format, export_options(query)});
  if (!job) refused = take_fault(503, "CODE_FAILED", "eight exports wait; try again when one has ended");
  return job;
}

void TakeSite::answer_export(const std::string& name, const std::string& format, const Query& query, Done done) {
  if (format.empty()) return done(take_fault(400, "CODE_INVALID", "format is missing; mocapctl take export --help"));
  HttpReply refused;
  const auto job = wish_export(name, format, query, refused);
  if (!job) return done(std::move(refused));
  ordered_json json{{"state", name_of(job->state)}, {"progress", job->progress.load()}, {"fault", job->fault}};
  json["file"] = fmt::format("{}{}.{}{}", kTakesPath, percent_encoded(name), format, query_of(query));
  done(json_reply(200, json));
}

void TakeSite::answer_file(const std::string& file_name, const Query& query, Done done) {
  const std::size_t dot = file_name.rfind('.');
  if (dot == std::string::npos || dot + 1 == file_name.size())
    return done(take_fault(404, "CODE_NOT_FOUND", "expected /takes/NAME.mcap or /takes/NAME.FORMAT"));
  const std::string name = file_name.substr(0, dot), format = file_name.substr(dot + 1);
  if (format == "mcap") {
    const bool queued = quick_.run([this, folder = folder_, name, file_name, done] {
      const Result<fs::path> path = take_file(folder, name);
      auto file = path ? OpenFile::open(*path) : Result<std::shared_ptr<OpenFile>>(path.error());
      run_here_([this, file = std::move(file), file_name, done] {
        if (!file) return done(fault_of(file.error()));
        download(*file, file_name, done);
      });
    });
    if (!queued) done(busy());
    return;
  }
  HttpReply refused;
  const auto job = wish_export(name, format, query, refused);
  if (!job) return done(std::move(refused));
  const auto tell = [this, file_name, done](const ExportJob& ended) {
    if (ended.state == ExportState::Failed) return done(take_fault(422, "CODE_FAILED", ended.fault));
    download(ended.file, file_name, done);
  };
  const bool ended = job->state == ExportState::Done || job->state == ExportState::Failed;
  if (ended) return tell(*job);
  job->waiting.emplace_back(tell);
}

void TakeSite::download(const std::shared_ptr<OpenFile>& file, const std::string& file_name, const Done& done) {
  if (*downloads_ >= kMaxDownloads)
    return done(take_fault(503, "CODE_FAILED", "eight downloads are under way; try again when one has ended"));
  HttpReply reply{200, "application/octet-stream", ""};
  reply.headers.emplace_back("Content-Disposition", "attachment; filename*=UTF-8''" + percent_encoded(file_name));
  reply.stream = std::make_shared<FileStream>(file, quick_, run_here_, downloads_);
  done(std::move(reply));
}

}  // namespace mocap::web
