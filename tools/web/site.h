#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "web/access/access.h"
#include "web/api.h"
#include "web/control_worker.h"
#include "web/feed/hub.h"
#include "web/feed/page_message.h"
#include "web/http_message.h"
#include "web/import_process.h"
#include "web/metrics/metrics.h"
#include "web/preflight_site.h"
#include "web/takes/take_site.h"
#include "web/worker.h"

namespace mocap::web {

inline constexpr std::string_view kImportPath = "/api/v1/subjects/import";
inline constexpr std::uint64_t kMaxUpload_bytes = 8 * 1024 * 1024;
inline constexpr int kMaxUploads = 2;

/// Runs a function in the thread of the Site.
using RunHere = std::function<void(std::function<void()>)>;

/// The answers to the requests of browsers and machines. One thread. The Hub and the workers outlive the Site.
class Site {
 public:
  struct Parts {
    Hub& hub;
    ControlWorker& reads;     ///< requests that change nothing
    ControlWorker& changes;   ///< requests that may take long
    ControlWorker& learning;  ///< requests that wait for images of the cameras, so that no other change waits for them
    TakeSite& takes;
    PreflightSite& preflight;
    Worker& imports;  ///< of C3D files
    RunHere run_here;
  };

  Site(AccessSettings access, const Parts& parts) : access_(std::move(access)), parts_(parts) {}

  /// Calls `done` at once, or when the daemon has answered.
  void answer(const HttpRequest& request, std::function<void(HttpReply)> done);

  /// Whether the body of the request is a file, up to kMaxUpload_bytes.
  static bool is_upload(const HttpRequest& request);

  /// A place for an upload, which ends with the object; otherwise the refusal. Only the header of the request is known.
  Result<std::shared_ptr<void>, HttpReply> admit_upload(const HttpRequest& request);

  /// Whether this request may open the connection of a page; otherwise the refusal.
  Result<Visitor, HttpReply> admit_page(const HttpRequest& request);

  /// Why this request may not open a connection that reads the feed; empty: it may.
  std::optional<HttpReply> refuse_reader(const HttpRequest& request);

  /// Executes a request of a page and says the answer, at once or when the daemon has answered.
  void answer(const RequestMessage& request, const Visitor& visitor, const std::string& remote,
              std::function<void(std::string)> say);

  /// {"state":...} for a page of this visitor.
  std::string state_text(const Visitor& visitor, Timestamp now) const;

  /// Ends the import that runs, and waits until it has left no file. Those that wait do not begin.
  void stop_imports();

  WebCounts& counts() { return counts_; }
  void note_refused(const std::string& reason) { ++counts_.refused[reason]; }

 private:
  /// The HTTP status of an answer and its JSON.
  using Answered = std::function<void(int status, const v1::Answer& answer)>;

  /// Imports a C3D file and adds its subject.
  void answer_import(const HttpRequest& request, const Visitor& visitor, std::function<void(HttpReply)> done);
  void add_imported(const Result<ImportedSubject>& imported, const std::string& name, const Visitor& visitor,
                    const std::string& remote, std::function<void(HttpReply)> done);
  HttpReply page_or_status(const HttpRequest& request, const std::optional<Visitor>& visitor);
  /// A refusal if the method of HTTP or the type of the body is not that of a change or a read.
  static std::optional<HttpReply> refuse_form(const HttpRequest& request, const std::string& name, bool changes);
  HttpReply refuse_role(const std::string& name);
  HttpReply readiness(bool tell_reason) const;
  HttpReply metrics() const;
  void find_takes();
  void answer_takes(const HttpRequest& request, const Visitor& visitor, std::function<void(HttpReply)> done);
  void answer_api(const HttpRequest& request, const Visitor& visitor, std::function<void(HttpReply)> done);
  void execute(const Method& method, const std::string& params, const Visitor& visitor, const std::string& remote,
               Answered done);

  Access access_;
  Parts parts_;
  WebCounts counts_;
  std::shared_ptr<int> uploads_ = std::make_shared<int>(0);  ///< under way
  std::atomic<bool> imports_stopped_ = false;
  std::uint64_t next_id_ = 1;
};

}  // namespace mocap::web
