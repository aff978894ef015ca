#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "model/audit.h"
#include "model/clock/timecode.h"
#include "model/take/shot.h"

namespace mocap {

enum class TakeAction { Start, Stop, Cancel, Mark, Next, ListShots, ImportShots, ClearShots };

/// A request of an operator about takes.
struct TakeOrder {
  std::uint64_t number = 0;  ///< of the order; its answer has the same
  TakeAction action = TakeAction::Start;
  Timestamp at = {};           ///< when the order came
  std::string name = {};       ///< Start: name of the take; empty: by [takes] name
  std::string slate = {};      ///< Start, Next; empty: the slate of the last take
  std::string text = {};       ///< Start, Next: notes; Mark: the text of the mark
  Duration before{};           ///< Start, Next: pre-roll: the take begins this long before its start time
  Duration length{};           ///< Start, Next: the take ends after this time; zero: at Stop
  Duration countdown{};        ///< Start, Next: the take starts after this time
  std::int64_t at_utc_ns = 0;  ///< Start, Next: the take starts at this time; 0: at once
  /// Start, Next: the take starts at this timecode; only hours to frames count. Empty: at once.
  std::optional<Timecode> at_timecode = {};
  std::vector<Shot> shots = {};  ///< ImportShots
  AuditActor by = {};            ///< who ordered
};

enum class TakeOutcome { Done, Invalid, NotFound, Failed };

/// The answer to an order.
struct TakeDone {
  std::uint64_t order = 0;
  TakeOutcome outcome = TakeOutcome::Done;
  std::string message;                          ///< for the operator
  std::optional<std::vector<Shot>> shots = {};  ///< of an order about shots
};

}  // namespace mocap
