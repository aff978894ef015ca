#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "stages/detect_kernels.h"

namespace mocap::stages {

inline constexpr std::size_t kMaxWords = 32768 / 64;

/// The bright pixels of one row, as the edges between bright and dark: words of 64 bits, a bit where the pixel differs
/// from the one before; those without any left out. Written to need few branches: which words are bright no processor
/// foresees, and each surprise costs as much as reading a thousand pixels.
class BrightWords {
 public:
  /// The bits of a few words of 64 pixels, from x on, a multiple of 64; in the order of x. What is left out is dark.
  template <std::size_t kCount>
  void add(int x, const std::array<std::uint64_t, kCount>& words) {
    if (carry_ != 0 && x != next_x_) close();
    for (const std::uint64_t bits : words) {
      push(x, bits ^ (bits << 1U | carry_));
      carry_ = bits >> 63U;
      x += 64;
    }
    next_x_ = x;
  }

  /// The row has bright pixels, and nobody wants to know which.
  void skip() { skipped_ = true; }

  /// Hands the row's runs on, or gives the row up.
  void flush(int y, RunSink& sink) {
    if (carry_ != 0) close();
    if (edges_ == 0 && !skipped_) return;
    const std::size_t runs = edges_ / 2;
    const bool fits = runs + kAhead <= sink.room.size() - sink.count;
    if (sink.used_up || skipped_ || runs > sink.row_bound || !fits) {
      ++sink.rows_given_up;
      sink.used_up |= runs <= sink.row_bound && !fits;
    } else {
      emit(static_cast<std::uint16_t>(y), sink.room.data() + sink.count);
      sink.count += runs;
    }
    count_ = edges_ = 0;
    skipped_ = false;
  }

 private:
  static constexpr std::size_t kAhead = 2;  // runs that are written before it is known whether they are

  void push(int x, std::uint64_t edges) {
    x_[count_] = static_cast<std::uint16_t>(x);
    words_[count_] = edges;
    edges_ += static_cast<std::size_t>(std::popcount(edges));
    count_ += edges != 0 ? 1 : 0;
  }

  /// A run reached the end of a word, and ends there.
  void close() {
    push(next_x_, 1);
    carry_ = 0;
  }

  void emit(std::uint16_t y, Run* out) const {
    std::size_t k = 0;  // an even edge begins a run, an odd one ends it
    const auto write = [&](std::size_t edge, int x) {
      Run& run = out[edge / 2];
      run.y = y;
      (edge % 2 == 0 ? run.begin : run.end) = static_cast<std::uint16_t>(x);
    };
    for (std::size_t i = 0; i < count_; ++i) {
      // The first two of a word are written without asking whether they are: what comes later overwrites them.
      std::uint64_t left = words_[i];
      const std::size_t end = k + static_cast<std::size_t>(std::popcount(left));
      write(k, x_[i] + std::countr_zero(left));
      left &= left - 1;
      write(k + 1, x_[i] + std::countr_zero(left));
      left &= left - 1;
      for (k += 2; left != 0; left &= left - 1) write(k++, x_[i] + std::countr_zero(left));
      k = end;
    }
  }

  std::size_t count_ = 0;
  std::size_t edges_ = 0;
  bool skipped_ = false;
  std::uint64_t carry_ = 0;  // the last pixel so far
  int next_x_ = 0;           // where it may go on
  std::array<std::uint16_t, kMaxWords + 2> x_;
  std::array<std::uint64_t, kMaxWords + 2> words_;
};

/// The bands that an image is read in, row by row in turn: memory feeds a few streams faster than a single one. Each
/// has its share of the room for runs.
class Bands {
 public:
  Bands(const ScanRows& rows, RunSink& sink) : whole_(sink), rows_(rows.rows) {
    count_ = rows.rows < kLeastRows ? 1 : kCount;
    height_ = (rows.rows + count_ - 1) / count_;
    const std::span<Run> free = sink.room.subspan(sink.count);
    const std::size_t share = free.size() / static_cast<std::size_t>(count_);
    for (int i = 0; i < count_; ++i) {
      sinks_[static_cast<std::size_t>(i)].room = free.subspan(static_cast<std::size_t>(i) * share, share);
      sinks_[static_cast<std::size_t>(i)].row_bound = sink.row_bound;
      sinks_[static_cast<std::size_t>(i)].used_up = sink.used_up;
    }
  }

  static constexpr int kCount = 4;
  int count() const { return count_; }
  int height() const { return height_; }  ///< of each; the last ones may be less
  /// A row of a band, counted from its top; -1 where the image ends before it.
  int row(int band, int at) const {
    const int row = band * height_ + at;
    return row < rows_ ? row : -1;
  }
  RunSink& sink(int band) { return sinks_[static_cast<std::size_t>(band)]; }

  /// Moves all runs together, in the order of rows.
  void gather() {
    for (int i = 0; i < count_; ++i) {
      const RunSink& from = sink(i);
      Run* to = whole_.room.data() + whole_.count;
      if (to != from.room.data()) std::copy_n(from.room.data(), from.count, to);
      whole_.count += from.count;
      whole_.rows_given_up += from.rows_given_up;
      whole_.used_up |= from.used_up;
    }
  }

 private:
  static constexpr int kLeastRows = 16;

  RunSink& whole_;
  int rows_, count_, height_;
  std::array<RunSink, kCount> sinks_;
};

}  // namespace mocap::stages
