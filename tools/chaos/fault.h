#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/random.h"

namespace mocap::chaos {

/// A disturbance of cameras, people, wire or disk. The meaning of `amount` and the bounds: the table in fault.cpp.
enum class FaultKind : std::uint8_t {
  FramesLost,
  FramesLate,
  FramesRepeated,
  FramesSwapped,
  ClockStep,
  ClockDrift,
  ClockStill,
  Unplugged,
  Bumped,
  Dazzled,
  NoiseStorm,
  HostStalls,
  PublisherStalls,
  SubjectAway,
  SubjectLies,
  SubjectsSwap,
  SubjectReset,
  SubjectRemoved,
  MessagesLost,
  MessagesCut,
  TakeRecorded,
  TakeNext,
  TakeCancelled,
  TakeCut,
  DiskFull,
  FolderGone,
  Reload,
};

/// One disturbance in the interval from `from_s`, included, to `from_s + for_s`, excluded.
struct Fault {
  FaultKind kind = FaultKind::FramesLost;
  double from_s = 0.0;
  double for_s = 0.0;
  std::uint32_t target = 0;  ///< camera or subject; 0 for the other kinds
  double amount = 0.0;

  double to_s() const { return from_s + for_s; }
  bool is_active(double t_s) const { return t_s >= from_s && t_s < to_s(); }
  friend bool operator==(const Fault&, const Fault&) = default;
};

/// Bounds of the drawn faults.
struct FaultBounds {
  std::uint32_t cameras = 4;
  std::uint32_t subjects = 2;
  double first_s = 2.0;  ///< no fault begins earlier
  double last_s = 5.0;   ///< no fault ends later
  std::uint32_t most = 8;
};

/// Draws time, target and amount of a fault of this kind.
Fault draw_fault(FaultKind kind, scene::Random& random, const FaultBounds& bounds);

/// Draws up to `bounds.most` faults, in the order of their begin.
std::vector<Fault> draw_faults(scene::Random& random, const FaultBounds& bounds);

/// "frames-lost".
const char* name_of(FaultKind kind);
/// Nothing: there is no such kind.
std::optional<FaultKind> fault_kind_named(std::string_view name);
/// All kinds, in the order of the enumeration.
std::vector<FaultKind> all_fault_kinds();

/// "2.35 s for 0.41 s: frames-lost camera 3, 0.52 of the frames".
std::string to_text(const Fault& fault);

/// The fault of this kind and target that is active, the first of several; null: none.
const Fault* active_fault(std::span<const Fault> faults, FaultKind kind, std::uint32_t target, double t_s);

}  // namespace mocap::chaos
