#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/benchmark/label_run.h"

namespace mocap::eval {

/// One run of the benchmark of labels.
struct BenchmarkCase {
  std::string take;
  benchmark::BodyKnown mode = benchmark::BodyKnown::Given;
  std::string noise;
  std::uint64_t seed = 0;
  std::vector<std::string> markers;  ///< labels
  benchmark::LabelRun run;
};

/// A table for people: its head, and a line for each run.
std::string benchmark_header();
std::string benchmark_line(const BenchmarkCase& one);

/// Why labels were withheld in all runs of a take together: a histogram, and the markers with most withheld labels.
std::string benchmark_reasons(const std::vector<BenchmarkCase>& cases);

/// One JSON object in one line.
std::string benchmark_json(const std::vector<BenchmarkCase>& cases);

/// Writes a drawing: a bar of macro F1 for each run, from 0.9 to 1. Fails with Io.
Status write_benchmark_svg(const std::filesystem::path& file, const std::vector<BenchmarkCase>& cases);

}  // namespace mocap::eval
