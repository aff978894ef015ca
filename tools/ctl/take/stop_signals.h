#pragma once

namespace mocap::ctl {

/// While it lives, SIGINT and SIGTERM are counted instead of ending the program, so that long work can remove what is
/// half done. One more than kMost end the program at once. One at a time.
class StopSignals {
 public:
  static constexpr int kMost = 2;

  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  int count() const noexcept;
  /// Ends the program by the last signal, as if it had not been counted; returns if there was none.
  void end_program() const;
};

}  // namespace mocap::ctl
