#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/child_process.h"
#include "base/result.h"
#include "lib/retrack/chunk.h"

namespace mocap::farm {

/// The unit of work: one take, or a chunk of one, that is tracked again by one process. Absolute paths.
struct Unit {
  std::filesystem::path take;
  std::filesystem::path out;                 ///< the new take, which the chunks become
  std::uint64_t bytes = 0;                   ///< of the take: its share of the work
  std::optional<retrack::Chunk> chunk = {};  ///< nothing: the whole take
};

/// The takes, each with its new take: NAME.mcap in `folder`, which is created, for the take NAME.mcap; without a folder
/// NAME-retracked.mcap in the current one. Folders among the takes: all takes in them. Fails with InvalidArgument (no
/// take; two of one name) and Io.
Result<std::vector<Unit>> make_units(const std::vector<std::filesystem::path>& takes,
                                     const std::filesystem::path& folder);

/// Each unit in `chunks` chunks.
std::vector<Unit> in_chunks(const std::vector<Unit>& units, std::uint32_t chunks);

/// The file that a unit writes.
std::filesystem::path file_of(const Unit& unit);

/// The name of the new take if none is given: NAME-retracked.mcap in the current folder.
std::filesystem::path default_out(const std::filesystem::path& take);

/// The settings that all units have in common.
struct UnitCommand {
  std::filesystem::path mocapctl;    ///< the program
  std::vector<std::string> options;  ///< of `take retrack`, with absolute paths
};

/// The command that does one unit, and prints one line of JSON.
std::vector<std::string> command_of(const UnitCommand& common, const Unit& unit);

/// The command that joins the chunks of a new take, and removes them.
std::vector<std::string> join_command(const std::filesystem::path& mocapctl, const std::filesystem::path& out,
                                      std::uint32_t chunks);

/// How a unit ended.
struct UnitResult {
  enum class Kind { Tracked, Kept, Failed, Stopped };

  Kind kind = Kind::Failed;
  int exit_code = 0;              ///< as of mocapctl
  std::string reason;             ///< of a failure
  nlohmann::ordered_json report;  ///< Tracked, Kept: as of `take retrack --json`
};

/// Reads the output of the command of a unit.
class UnitOutput {
 public:
  void add(std::string_view line);

  double share() const noexcept { return share_; }  ///< of the work that is done
  UnitResult result(const ProcessEnd& ended) const;

 private:
  double share_ = 0.0;
  std::string words_;  // neither progress nor JSON
  nlohmann::ordered_json report_;
};

}  // namespace mocap::farm
