#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>

namespace mocap::fuzz {

/// The arguments of a fuzzer: NAME_fuzz [COUNT [SEED]]. A fuzzer makes a fixed number of inputs, so that every machine
/// tries the same inputs.
struct Arguments {
  std::uint64_t count = 1000;
  std::uint64_t seed = 1;

  Arguments(int argc, char** argv) {
    if (argc > 1) count = std::strtoull(argv[1], nullptr, 10);
    if (argc > 2) seed = std::strtoull(argv[2], nullptr, 10);
  }

  void print(const char* inputs) const {
    std::printf("%llu %s, seed %llu\n", static_cast<unsigned long long>(count), inputs,
                static_cast<unsigned long long>(seed));
  }
};

/// Runs a fuzzer of files: Fuzz(seed), try_once(), read(), the number of inputs that were read without a fault. Returns
/// the exit code: 1 if not one of a hundred inputs or more was read, because such inputs test little.
template <class Fuzz>
int run_reading(int argc, char** argv, const char* inputs) {
  const Arguments arguments(argc, argv);
  Fuzz fuzz(arguments.seed);
  for (std::uint64_t i = 0; i < arguments.count; ++i) fuzz.try_once();
  arguments.print(inputs);
  return arguments.count < 100 || fuzz.read() > 0 ? 0 : 1;
}

}  // namespace mocap::fuzz
