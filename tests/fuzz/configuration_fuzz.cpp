#include <array>
#include <cmath>
#include <filesystem>
#include <string>

#include "base/expects.h"
#include "base/log.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "settings/daemon_settings.h"
#include "settings/packed_files.h"
#include "support/temporary_folder.h"

// Fuzzes the readers of configurations and of the daemon's state files: the shipped configurations with bytes, lines,
// numbers and texts changed, and keys that are comments there made keys. Each configuration must be loaded or refused
// with faults that name a place; a loaded one can be listed, and packed, unpacked and loaded once more.
//
// usage: configuration_fuzz [COUNT [SEED]]

namespace mocap::settings {
namespace {

namespace fs = std::filesystem;
using fuzz::Inputs;

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed)
      : configurations_(Inputs::Kind::Text, seed, fuzz::files_in("config", ".toml")),
        subjects_(Inputs::Kind::Text, seed + 1, fuzz::files_in("tests/fuzz/seeds/state")) {
    set_log_level(LogLevel::Error);
    fs::copy(support::source_folder() + "/config", folder_.path() / "config", fs::copy_options::recursive);
    fs::create_directory(folder_.path() / "state");
  }

  void try_once() {
    const fs::path path = folder_.write("config/fuzz.toml", configurations_.next());
    const StateFiles state = state_files(folder_.path() / "state");
    std::error_code ignored;
    const std::array files{state.added_subjects, state.learnt_masks, state.drawn_masks};
    for (const fs::path& file : files) fs::remove(file, ignored);
    if (configurations_.below(3) == 0) {
      const fs::path& file = files[configurations_.below(files.size())];
      folder_.write(fs::relative(file, folder_.path()).string(), subjects_.next());
    }
    const auto settings =
        load_daemon_settings(path, state, configurations_.below(2) == 0 ? RigNeed::Whole : RigNeed::AsFound);
    if (!settings) return check(settings.error());
    ++loaded_;
    for (const auto& [key, value] : list_settings(*settings)) MOCAP_EXPECTS(!key.empty());
    MOCAP_EXPECTS(settings->rig.size() == settings->cameras.size());
    MOCAP_EXPECTS(std::isfinite(settings->nominal_rate_hz));
    repack(*settings);
  }

  std::uint64_t read() const { return loaded_; }

 private:
  static void check(const Faults& faults) {
    MOCAP_EXPECTS(!faults.list.empty() && !to_text(faults).empty());
    for (const Fault& fault : faults.list) MOCAP_EXPECTS(!fault.message.empty());
  }

  void repack(const DaemonSettings& settings) {
    const fs::path there = folder_.path() / "unpacked";
    fs::create_directory(there);
    const auto unpacked = unpack_files(pack_files(settings), there);
    if (unpacked) {
      const auto again = load_daemon_settings(unpacked->configuration, unpacked->state, RigNeed::AsFound);
      if (!again) check(again.error());
    } else {
      MOCAP_EXPECTS(!unpacked.error().message.empty());
    }
    fs::remove_all(there);
  }

  support::TemporaryFolder folder_;
  Inputs configurations_, subjects_;
  std::uint64_t loaded_ = 0;
};

}  // namespace
}  // namespace mocap::settings

int main(int argc, char** argv) {
  return mocap::fuzz::run_reading<mocap::settings::Fuzz>(argc, argv, "configurations");
}
