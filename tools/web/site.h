#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "web/access/access.h"
#include "web/api.h"
#include "web/control_worker.h"
#include "web/feed/hub.h"
#include "web/feed/page_message.h"
#include "web/http_message.h"
#include "web/metrics/metrics.h"
#include "web/preflight_site.h"
#include "web/takes/take_site.h"

namespace mocap::web {

/// Runs a function in the thread of the Site.
using RunHere = std::function<void(std::function<void()>)>;

/// The answers to the requests of browsers and machines. One thread. The Hub and the workers outlive the Site.
class Site {
 public:
  struct Parts {
    Hub& hub;
    ControlWorker& reads;    ///< requests that change nothing
    ControlWorker& changes;  ///< requests that may take long
    TakeSite& takes;
    PreflightSite& preflight;
    RunHere run_here;
  };

  Site(AccessSettings access, const Parts& parts) : access_(std::move(access)), parts_(parts) {}

  /// Calls `done` at once, or when the daemon has answered.
  void answer(const HttpRequest& request, std::function<void(HttpReply)> done);

  /// Whether this request may open the connection of a page; otherwise the refusal.
  Result<Visitor, HttpReply> admit_page(const HttpRequest& request);

  /// Why this request may not open a connection that reads the feed; empty: it may.
  std::optional<HttpReply> refuse_reader(const HttpRequest& request);

  /// Executes a request of a page and says the answer, at once or when the daemon has answered.
  void answer(const RequestMessage& request, const Visitor& visitor, const std::string& remote,
              std::function<void(std::string)> say);

  /// {"state":...} for a page of this visitor.
  std::string state_text(const Visitor& visitor, Timestamp now) const;

  WebCounts& counts() { return counts_; }
  void note_refused(const std::string& reason) { ++counts_.refused[reason]; }

 private:
  /// The HTTP status of an answer and its JSON.
  using Answered = std::function<void(int status, const v1::Answer& answer)>;

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
  std::uint64_t next_id_ = 1;
};

}  // namespace mocap::web
