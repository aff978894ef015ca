#pragma once

#include <string_view>

#include "base/result.h"

namespace mocap {

enum class LogLevel { Debug, Info, Warn, Error };

/// One line "who: what happened, key=value with units" to standard error. Repeats of one line are folded into one a
/// second with their count. Any thread, but never a hot path: it allocates and takes a lock.
///
/// info: a change of state. warn: degraded, and what was done. error: an operator must act, and how.
void log_debug(std::string_view who, std::string_view what);
void log_info(std::string_view who, std::string_view what);
void log_warn(std::string_view who, std::string_view what);
void log_error(std::string_view who, std::string_view what);

/// Lines below this level are left out; Info at the start.
void set_log_level(LogLevel level);

/// With journald prefixes ("<4>") and no time, as systemd reads them, or with local time for a terminal.
void set_log_for_journal(bool journal);

}  // namespace mocap
