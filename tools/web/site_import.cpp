// The part of Site that adds a subject from a C3D file.
#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/file_name.h"
#include "web/query.h"
#include "web/site.h"
#include "web/takes/export_process.h"

namespace mocap::web {
namespace {

using nlohmann::ordered_json;

// A static trial of some seconds takes less than a second.
constexpr std::chrono::seconds kImportPatience{60};

HttpReply import_reply(int status, const char* code, const std::string& message) {
  const ordered_json json{{"code", code}, {"message", message}};
  return {status, "application/json", json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + '\n'};
}

}  // namespace

bool Site::is_upload(const HttpRequest& request) { return request.method == "POST" && request.path == kImportPath; }

Result<std::shared_ptr<void>, HttpReply> Site::admit_upload(const HttpRequest& request) {
  if (auto foreign = access_.refuse_foreign(request)) {
    note_refused("foreign");
    return *std::move(foreign);
  }
  const std::optional<Visitor> visitor = access_.visitor(request);
  if (!visitor) {
    note_refused("token");
    return import_reply(401, "CODE_FORBIDDEN", "a token is needed");
  }
  if (visitor->role != wire::Role::Operator) return refuse_role("subjects/import");
  if (*uploads_ >= kMaxUploads) {
    return import_reply(503, "CODE_FAILED", "two files are being imported; try again when one has ended");
  }
  ++*uploads_;
  return std::shared_ptr<void>(nullptr, [uploads = uploads_](void*) { --*uploads; });
}

void Site::stop_imports() {
  imports_stopped_ = true;
  parts_.imports.stop();
}

void Site::answer_import(const HttpRequest& request, const Visitor& visitor, std::function<void(HttpReply)> done) {
  if (request.method != "POST") {
    HttpReply reply = import_reply(405, "CODE_INVALID", "subjects/import: expected POST");
    reply.headers.emplace_back("Allow", "POST");
    return done(std::move(reply));
  }
  // Protects against requests of other sites: an HTML form can send only three other content types, and a script of
  // another site must first get the server's permission for this type (CORS preflight).
  if (request.content_type != "application/octet-stream") {
    return done(import_reply(415, "CODE_INVALID", "Content-Type: expected application/octet-stream"));
  }
  if (visitor.role != wire::Role::Operator) return done(refuse_role("subjects/import"));
  const auto query = read_query(request.query);
  const std::string name = query && query->contains("name") ? query->at("name") : std::string();
  if (!is_file_name(name)) {
    return done(
        import_reply(400, "CODE_INVALID",
                     "name: expected at most 64 letters, digits, '_', '-', '.' or spaces, the first a letter, a "
                     "digit or '_'"));
  }
  if (request.body.empty()) return done(import_reply(400, "CODE_INVALID", "the file is empty, expected a C3D file"));
  ImportWish wish{name, query->contains("static") && query->at("static") == "true", request.body};
  const bool queued = parts_.imports.run([this, wish = std::move(wish), visitor, remote = request.remote, done] {
    Result<ImportedSubject> imported = run_import(mocapctl_here(), wish, kImportPatience, imports_stopped_);
    parts_.run_here([this, imported = std::move(imported), name = wish.name, visitor, remote, done] {
      add_imported(imported, name, visitor, remote, done);
    });
  });
  if (!queued) done(import_reply(503, "CODE_FAILED", "too many files wait for their import; try again"));
}

void Site::add_imported(const Result<ImportedSubject>& imported, const std::string& name, const Visitor& visitor,
                        const std::string& remote, std::function<void(HttpReply)> done) {
  if (!imported) {
    const bool faulty = imported.error().code == ErrorCode::InvalidArgument;
    return done(import_reply(faulty ? 422 : 502, "CODE_FAILED", imported.error().message));
  }
  const ordered_json params{{"action", "ACTION_ADD"}, {"name", name}, {"markerSetText", imported->marker_set}};
  const std::string text = params.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
  execute(
      *find_method("subject"), text, visitor, remote,
      [imported = *imported, done = std::move(done)](int status, const v1::Answer& answer) {
        ordered_json json{{"code", v1::Code_Name(answer.code())}, {"message", answer.message()}};
        json["report"] = ordered_json::parse(imported.report_json, nullptr, false);
        json["warnings"] = imported.warnings;
        done({status, "application/json", json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + '\n'});
      });
}

}  // namespace mocap::web
