#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "lib/join/join.h"
#include "lib/retrack/retrack.h"
#include "tools_retrack/recorded_world.h"

namespace mocap::join {

using retrack::Chunk;
using retrack::RecordedWorld;

// A take of 8 s, tracked as a whole and in two chunks that overlap by 1.5 s.
class ChunkedTake {
 public:
  static constexpr std::uint64_t kSets = 480;
  static constexpr Duration kOverlap = std::chrono::milliseconds(1500);

  ChunkedTake() : recorded_(world_.record("walk", {.sets = kSets})) {
    track({.take = recorded_, .out = whole()});
    for (std::uint32_t number : {1U, 2U}) {
      track({.take = recorded_, .out = joined(), .chunk = Chunk{.number = number, .of = 2, .overlap = kOverlap}});
    }
  }

  const std::filesystem::path& folder() const { return world_.folder(); }
  const std::filesystem::path& recorded() const { return recorded_; }
  std::filesystem::path whole() const { return folder() / "whole.mcap"; }
  std::filesystem::path joined() const { return folder() / "joined.mcap"; }
  std::filesystem::path chunk(std::uint32_t number, std::uint32_t of = 2) const {
    return retrack::chunk_file(joined(), {.number = number, .of = of});
  }

  static void track(const retrack::RetrackOrder& order) {
    const auto report = retrack::retrack(order, [](const auto&) { return true; });
    ASSERT_TRUE(report) << report.error().message;
  }

  // Made once: it takes a second. Tests do not change its files.
  static const ChunkedTake& shared() {
    static const ChunkedTake take;
    return take;
  }

 private:
  RecordedWorld world_;
  std::filesystem::path recorded_;
};

inline std::vector<v1::Snapshot> messages_in(const std::filesystem::path& path) {
  std::vector<v1::Snapshot> messages;
  for (const std::string& bytes : retrack::snapshots_in(path))
    EXPECT_TRUE(messages.emplace_back().ParseFromString(bytes));
  return messages;
}

}  // namespace mocap::join
