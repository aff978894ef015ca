#pragma once

namespace mocap {

/// Prints the violated condition and stops the process.
[[noreturn]] void expectation_failed(const char* condition, const char* file, int line) noexcept;

}  // namespace mocap

/// A condition that only a bug can violate, checked in every build. Never for data from outside.
#define MOCAP_EXPECTS(condition) \
  ((condition) ? static_cast<void>(0) : ::mocap::expectation_failed(#condition, __FILE__, __LINE__))
