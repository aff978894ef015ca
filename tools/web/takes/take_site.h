#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include "web/http_message.h"
#include "web/takes/exports.h"
#include "web/worker.h"

namespace mocap::web {

inline constexpr std::string_view kTakesApi = "/api/v1/takes";
inline constexpr std::string_view kTakesPath = "/takes/";  ///< files for a download
inline constexpr int kMaxDownloads = 8;

/// The answers to requests about recorded takes: their files are read and written by workers, never in the server's
/// loop. Of the thread of the loop.
class TakeSite {
 public:
  using RunHere = std::function<void(std::function<void()>)>;
  using Done = std::function<void(HttpReply)>;

  /// `folder`: of the takes; empty: that of the take which the daemon reports, if the daemon is on this machine (its
  /// endpoint `feed` is local, see wire::is_local) and the take is readable.
  TakeSite(std::filesystem::path folder, std::string feed, RunHere run_here);

  /// The path of the newest take that the daemon reports; empty: none. On another machine than the daemon's, a take of
  /// the same path is another take, so the path of a remote daemon names no folder.
  void note_take(const std::string& path);
  /// Empty: unknown.
  const std::filesystem::path& folder() const { return folder_; }

  static bool is_about_takes(std::string_view path);

  /// Answers a request about takes; a change was permitted before. Calls `done` once.
  void answer(const HttpRequest& request, Done done);

  bool is_busy() const { return quick_.is_busy() || slow_.is_busy(); }

  /// Ends the exports, and waits until they have left no file.
  void stop_exports() { exports_.stop(); }

 private:
  using Query = std::map<std::string, std::string>;

  /// Why the folder is unknown, and the remedy.
  std::string folder_unknown() const;
  void answer_api(const HttpRequest& request, const std::string& name, const std::string& verb, const Query& query,
                  Done done);
  void answer_file(const std::string& file_name, const Query& query, Done done);
  void answer_export(const std::string& name, const std::string& format, const Query& query, Done done);
  std::shared_ptr<ExportJob> wish_export(const std::string& name, const std::string& format, const Query& query,
                                         HttpReply& refused);
  void download(const std::shared_ptr<OpenFile>& file, const std::string& file_name, const Done& done);
  /// Makes the reply in the worker's thread and gives it to `done` in the loop's.
  void reply_from(Worker& worker, std::function<HttpReply()> make, Done done);

  std::filesystem::path folder_;
  bool folder_given_;
  std::string feed_;
  std::string reported_;  // path of the newest take that the daemon reports
  std::string obstacle_;  // why the reported take is not readable here
  RunHere run_here_;
  std::shared_ptr<std::atomic<int>> downloads_ = std::make_shared<std::atomic<int>>(0);
  Exports exports_;
  Worker quick_;  ///< reads lists and pieces
  Worker slow_;   ///< reads whole takes
};

/// Whether a request about takes needs POST and the role operator; the others need GET.
bool is_change_of_take(const HttpRequest& request);

}  // namespace mocap::web
