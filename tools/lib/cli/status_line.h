#pragma once

#include <string_view>

namespace mocap::cli {

/// A line on standard error that the next one overwrites: the progress of long work. Prints nothing if standard error
/// is no terminal. Erased at the end of its life.
class StatusLine {
 public:
  StatusLine();
  ~StatusLine() { clear(); }
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  bool on_terminal() const noexcept { return on_terminal_; }
  void show(std::string_view line);
  void clear();

 private:
  bool on_terminal_;
  bool shown_ = false;
};

}  // namespace mocap::cli
