#include "web/site.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "web/openapi.h"
#include "web/page_files.h"
#include "wire/codec/utf8.h"

namespace mocap::web {
namespace {

v1::Answer refused(v1::Code code, std::string message) {
  v1::Answer answer;
  answer.set_code(code);
  answer.set_message(std::move(message));
  return answer;
}

HttpReply reply_with(int status, const v1::Answer& answer) {
  return {status, "application/json", json_of(answer) + '\n'};
}

HttpReply no_token() {
  HttpReply reply = refusal(401,
                            "a token is needed: open /?token=TOKEN once, or send Authorization: Bearer TOKEN; "
                            "mocap-web token makes one");
  reply.headers.emplace_back("WWW-Authenticate", "Bearer");
  return reply;
}

// One line: an answer's text may have several.
std::string one_line(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < 0x20; }, ' ');
  return text;
}

// Who changed or downloaded what, from where, with which result.
void audit(const Visitor& visitor, const std::string& remote, const std::string& method, const std::string& params,
           const std::string& answer) {
  constexpr std::size_t kMaxParams = 1000;
  fmt::print(stderr, "mocap-web: audit: who={} role={} from={} method={} params={} answer={}\n", visitor.name,
             wire::name_of(visitor.role), remote, method, one_line(params.substr(0, kMaxParams)), one_line(answer));
  std::fflush(stderr);
}

bool is_json(const std::string& content_type) {
  return content_type.starts_with("application/json") &&
         (content_type.size() == 16 || content_type[16] == ';' || content_type[16] == ' ');
}

}  // namespace

HttpReply Site::readiness(bool tell_reason) const {
  const FeedStatus status = parts_.hub.status(host_now());
  if (status.connected) return refusal(200, "ready");
  return refusal(503, tell_reason ? "not ready: " + status.reason : std::string("not ready"));
}

HttpReply Site::metrics() const {
  const FeedStatus status = parts_.hub.status(host_now());
  MetricsInput input{status.connected, status.age_s, parts_.hub.health(), parts_.hub.description(), counts_};
  input.counts.viewers = parts_.hub.viewer_count();
  input.counts.dropped_snapshots = parts_.hub.dropped_snapshots();
  return {200, std::string(kMetricsType), metrics_text(input)};
}

HttpReply Site::page_or_status(const HttpRequest& request, const std::optional<Visitor>& visitor) {
  const bool reads = request.method == "GET" || request.method == "HEAD";
  if (!reads) {
    HttpReply reply = refusal(405, "expected GET");
    reply.headers.emplace_back("Allow", "GET, HEAD");
    return reply;
  }
  if (request.path == "/healthz") return refusal(200, "ok");
  if (request.path == "/readyz") return readiness(visitor.has_value());
  if (!visitor) return no_token();
  if (request.path == "/metrics") return metrics();
  if (const std::string token = token_in_query(request.query); request.path == "/" && !token.empty()) {
    // The token leaves the address bar and the history.
    return {303, "text/plain", "", {{"Location", "/"}, {"Set-Cookie", token_cookie(token)}}};
  }
  return reply_with_file(page_files(), request);
}

void Site::answer(const HttpRequest& request, std::function<void(HttpReply)> done) {
  ++counts_.requests;
  if (auto foreign = access_.refuse_foreign(request)) {
    note_refused("foreign");
    return done(*std::move(foreign));
  }
  const std::optional<Visitor> visitor = access_.visitor(request);
  const bool takes = TakeSite::is_about_takes(request.path);
  if (!takes && !request.path.starts_with(kApiPath)) return done(page_or_status(request, visitor));
  if (visitor && takes) return answer_takes(request, *visitor, std::move(done));
  if (visitor) return answer_api(request, *visitor, std::move(done));
  note_refused("token");
  done(no_token());
}

std::optional<HttpReply> Site::refuse_form(const HttpRequest& request, const std::string& name, bool changes) {
  const std::string expected = changes ? "POST" : "GET";
  if (request.method != expected && !(request.method == "HEAD" && !changes)) {
    HttpReply reply = reply_with(405, refused(v1::CODE_INVALID, name + ": expected " + expected));
    reply.headers.emplace_back("Allow", expected);
    return reply;
  }
  // A form of another site can send any other type without asking the browser first.
  if (changes && !is_json(request.content_type))
    return reply_with(415, refused(v1::CODE_INVALID, "Content-Type: expected application/json"));
  return std::nullopt;
}

HttpReply Site::refuse_role(const std::string& name) {
  note_refused("role");
  return reply_with(403, refused(v1::CODE_FORBIDDEN, name + ": needs the role operator, you are viewer"));
}

void Site::find_takes() {
  if (const v1::Health* health = parts_.hub.health()) parts_.takes.note_take(health->take().path());
}

void Site::answer_takes(const HttpRequest& request, const Visitor& visitor, std::function<void(HttpReply)> done) {
  const bool changes = is_change_of_take(request);
  if (auto reply = refuse_form(request, "takes", changes)) return done(*std::move(reply));
  find_takes();
  if (!changes && !request.path.starts_with(kTakesPath)) return parts_.takes.answer(request, std::move(done));
  if (!changes) {
    return parts_.takes.answer(request, [visitor, request, done = std::move(done)](HttpReply reply) {
      if (reply.status == 200 && request.method == "GET")
        audit(visitor, request.remote, request.path, request.query, "200");
      done(std::move(reply));
    });
  }
  if (visitor.role != wire::Role::Operator) return done(refuse_role("takes"));
  ++counts_.changes;
  parts_.takes.answer(request, [visitor, request, done = std::move(done)](HttpReply reply) {
    audit(visitor, request.remote, request.path, request.body, reply.body);
    done(std::move(reply));
  });
}

void Site::answer_api(const HttpRequest& request, const Visitor& visitor, std::function<void(HttpReply)> done) {
  if (request.path == kImportPath) return answer_import(request, visitor, std::move(done));
  const std::string name = request.path.substr(kApiPath.size());
  if (name == "openapi.json" && request.method == "GET") return done({200, "application/json", openapi_json()});
  if (name == "preflight" && request.method == "GET") {
    find_takes();
    return parts_.preflight.answer(parts_.takes.folder(), std::move(done));
  }
  const Method* method = find_method(name);
  if (method == nullptr) {
    return done(
        reply_with(404, refused(v1::CODE_NOT_FOUND, "there is no such method; /api/v1/openapi.json lists all")));
  }
  if (auto reply = refuse_form(request, name, method->changes)) return done(*std::move(reply));
  execute(*method, request.body, visitor, request.remote,
          [done = std::move(done)](int status, const v1::Answer& answer) { done(reply_with(status, answer)); });
}

void Site::execute(const Method& method, const std::string& params, const Visitor& visitor, const std::string& remote,
                   Answered done) {
  Result<v1::Request> request = request_of(method, params);
  if (!request) return done(400, refused(v1::CODE_INVALID, request.error().message));
  const bool changes = is_change(method, *request);
  if (changes && visitor.role != wire::Role::Operator) {
    note_refused("role");
    return done(403, refused(v1::CODE_FORBIDDEN, method.name + ": needs the role operator, you are viewer"));
  }
  request->set_id(next_id_++);
  request->set_asked_by(wire::valid_utf8(visitor.name));  // the audit log of the daemon has the name of this one
  if (changes) ++counts_.changes;
  auto finish = [method, changes, visitor, remote, request = *request, done](const Result<std::string>& came) {
    v1::Answer answer;
    const bool answered = came && answer.ParseFromString(*came);
    if (!answered)
      answer = refused(v1::CODE_FAILED, came ? "the answer is not a mocap.v1 message" : came.error().message);
    if (changes) {
      audit(visitor, remote, method.name, params_of(request),
            fmt::format("{} {}", v1::Code_Name(answer.code()), answer.message()));
    }
    done(answered ? http_status_of(answer.code()) : 503, answer);
  };
  const Duration patience = patience_of(method, *request);
  ControlWorker& worker = is_learning(*request) ? parts_.learning : changes ? parts_.changes : parts_.reads;
  const bool queued = worker.ask(request->SerializeAsString(), patience,
                                 [run_here = parts_.run_here, finish](Result<std::string> came) {
                                   run_here([finish, came = std::move(came)] { finish(came); });
                                 });
  if (!queued) done(503, refused(v1::CODE_FAILED, "too many requests wait for the daemon; try again"));
}

Result<Visitor, HttpReply> Site::admit_page(const HttpRequest& request) {
  if (auto foreign = access_.refuse_foreign(request)) {
    note_refused("foreign");
    return *std::move(foreign);
  }
  if (auto visitor = access_.visitor(request)) return *std::move(visitor);
  note_refused("token");
  return no_token();
}

std::optional<HttpReply> Site::refuse_reader(const HttpRequest& request) {
  if (auto foreign = access_.refuse_foreign_reader(request)) {
    note_refused("foreign");
    return foreign;
  }
  if (access_.visitor(request)) return std::nullopt;
  note_refused("token");
  return no_token();
}

void Site::answer(const RequestMessage& request, const Visitor& visitor, const std::string& remote,
                  std::function<void(std::string)> say) {
  const Method* method = find_method(request.method);
  if (method == nullptr) return say(error_text(request.id, "CODE_NOT_FOUND", "there is no such method"));
  execute(*method, request.params, visitor, remote,
          [id = request.id, say = std::move(say)](int status, const v1::Answer& answer) {
            if (status == 200) return say(answer_text(id, json_of(answer)));
            say(error_text(id, v1::Code_Name(answer.code()), answer.message()));
          });
}

std::string Site::state_text(const Visitor& visitor, Timestamp now) const {
  const FeedStatus status = parts_.hub.status(now);
  const nlohmann::json state{{"connected", status.connected},       {"age_s", status.age_s},
                             {"endpoint", parts_.hub.endpoint()},   {"reason", status.reason},
                             {"role", wire::name_of(visitor.role)}, {"version", MOCAP_VERSION}};
  return nlohmann::json{{"state", state}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace mocap::web
