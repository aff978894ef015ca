#include "base/expects.h"

#include <cstdio>
#include <cstdlib>

namespace mocap {

void expectation_failed(const char* condition, const char* file, int line) noexcept {
  std::fprintf(stderr, "%s:%d: violated precondition: %s\n", file, line, condition);
  std::abort();
}

}  // namespace mocap
