#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chaos/invariants.h"
#include "model/control.h"
#include "module/take_recorder.h"

namespace mocap::chaos {

/// The recorder of takes with its orders, in a real folder. Each take that ends is opened, checked and compared with
/// the snapshots that were recorded.
class TakeDesk {
 public:
  /// `after_end`: for tests, called with each take before the take is checked; may be empty.
  TakeDesk(std::filesystem::path folder, const Description& description,
           std::function<void(const std::filesystem::path&)> after_end);
  ~TakeDesk();

  void keep(const BlobFrame& frame);
  void keep(const Snapshot& snapshot);
  void learn(const SubjectFit& fit);
  void describe(const Description& description, Timestamp now);

  /// Sends the order as a request of the control socket. The recorder follows the request as it was decoded.
  void order(TakeAction action, Duration before, Timestamp now);
  /// Lets the recorder write, and checks a take that has ended.
  void work(Timestamp now);
  void finish(Timestamp now);

  /// A power cut: a copy of the file in progress that ends within its last bytes is repaired and checked. `kept`: share
  /// of the file that is left.
  void cut(double kept);
  /// Files that grow beyond their size by more than this fail, until `free_disk`.
  void fill_disk(double free_bytes);
  void free_disk();
  /// Removes the folder of the takes.
  void remove_folder();

  const Finding& finding() const { return finding_; }
  /// Snapshots in the takes that ended, or that a power cut left, each as it was recorded.
  std::uint64_t taken_snapshots() const { return taken_snapshots_; }

 private:
  struct Limit;
  void check_ended(const std::filesystem::path& take, bool whole);
  void compare(const std::filesystem::path& take);
  void note(const std::string& what, const Finding& finding);
  void follow_answers();

  std::filesystem::path folder_;
  std::unique_ptr<TakeRecorder> recorder_;
  std::function<void(const std::filesystem::path&)> after_end_;
  std::map<std::uint64_t, std::uint64_t> kept_;  // hash of each snapshot, by its number
  std::unique_ptr<Limit> limit_;                 // null: the disk has space
  std::uint64_t orders_ = 0;
  std::uint64_t open_orders_ = 0;
  std::filesystem::path open_take_;
  bool removed_ = false;
  Finding finding_;
  std::uint64_t taken_snapshots_ = 0;
};

}  // namespace mocap::chaos
