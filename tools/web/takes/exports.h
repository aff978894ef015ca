#pragma once

#include <atomic>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "web/takes/export_process.h"
#include "web/worker.h"

namespace mocap::web {

inline constexpr std::size_t kMaxExports = 8;  ///< that wait, run, or are kept for their download

enum class ExportState { Waiting, Running, Done, Failed };

/// One export, for those who asked for it.
struct ExportJob {
  std::string key;  ///< take and options
  ExportState state = ExportState::Waiting;
  std::atomic<double> progress = 0.0;
  std::string fault;
  std::shared_ptr<OpenFile> file;
  std::vector<std::function<void(const ExportJob&)>> waiting = {};  ///< called once, when the export has ended
};

/// The exports: one at a time, in the order of the requests. Of the thread of the server's loop; `run_here` runs a
/// function there.
class Exports {
 public:
  using RunHere = std::function<void(std::function<void()>)>;
  using Runner = std::function<Result<std::shared_ptr<OpenFile>>(const ExportWish&, std::atomic<double>& progress,
                                                                 const std::atomic<bool>& stopped)>;

  Exports(Runner runner, RunHere run_here) : runner_(std::move(runner)), run_here_(std::move(run_here)) {}
  ~Exports() { stop(); }
  Exports(const Exports&) = delete;
  Exports& operator=(const Exports&) = delete;

  /// The export that was wished before with the same `key`, or a new one. Null: too many wait. A failed export is
  /// returned once; the next wish tries again.
  std::shared_ptr<ExportJob> wish(const std::string& key, const ExportWish& wish);

  /// Ends the export that runs, and waits for its runner. Those that wait do not begin.
  void stop() {
    stopped_ = true;
    worker_.stop();
  }

 private:
  std::shared_ptr<ExportJob> find(const std::string& key);
  bool make_room();
  void end(ExportJob& job, Result<std::shared_ptr<OpenFile>> file);

  Runner runner_;
  RunHere run_here_;
  std::atomic<bool> stopped_ = false;
  std::deque<std::shared_ptr<ExportJob>> jobs_;  // oldest first
  Worker worker_;                                // last: its thread uses the others
};

}  // namespace mocap::web
