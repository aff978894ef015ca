#pragma once

namespace mocap::eval {

// The subcommands of mocap-eval. A new one needs a function here and one line in main.cpp.
int run_points(int argc, const char* const* argv);
int run_wand(int argc, const char* const* argv);
int run_drift(int argc, const char* const* argv);
int run_rigs(int argc, const char* const* argv);
int run_scene(int argc, const char* const* argv);
int run_paper(int argc, const char* const* argv);
int run_benchmark(int argc, const char* const* argv);

}  // namespace mocap::eval
