#pragma once

namespace mocap::eval {

/// `mocap-eval benchmark skeleton`.
int run_benchmark_skeleton(int argc, const char* const* argv);

}  // namespace mocap::eval
