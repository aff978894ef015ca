#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "stages/detect_kernels.h"

namespace mocap::stages {

inline constexpr std::size_t kMaxWords = 32768 / 64;

/// The bright pixels of one row: words of 64 bits, those without any left out.
class BrightWords {
 public:
  /// `bits` of the pixels from x on, x a multiple of 64; in the order of x.
  void add(int x, std::uint64_t bits) {
    x_[count_] = static_cast<std::uint16_t>(x);
    bits_[count_] = bits;
    const bool adjoins = count_ > 0 && x_[count_ - 1] + 64 == x;
    const std::uint64_t carry = adjoins ? bits_[count_ - 1] >> 63U : 0U;
    runs_ += static_cast<std::size_t>(std::popcount(bits & ~(bits << 1U | carry)));
    ++count_;
  }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = runs_ = 0; }

  /// Hands the row's runs on, or gives the row up.
  void flush(int y, RunSink& sink) {
    if (runs_ > sink.row_bound || runs_ > sink.room.size() - sink.count) {
      ++sink.rows_given_up;
    } else {
      emit(y, sink);
    }
    clear();
  }

 private:
  void emit(int y, RunSink& sink) const {
    Run* out = sink.room.data() + sink.count;
    const Run* first = out;
    int begin = -1;  // of the run that reaches the end of the word before
    int next_x = -1;
    for (std::size_t i = 0; i < count_; ++i) {
      const int x = x_[i];
      std::uint64_t bits = bits_[i];
      if (begin >= 0) {
        const int on = x == next_x ? std::countr_one(bits) : 0;
        if (on == 64) {
          next_x = x + 64;
          continue;
        }
        *out++ = run(y, begin, next_x + on);
        bits = bits >> on << on;
        begin = -1;
      }
      while (bits != 0) {
        const int from = std::countr_zero(bits);
        const int to = from + std::countr_one(bits >> from);
        if (to == 64) {
          begin = x + from;
          next_x = x + 64;
          break;
        }
        *out++ = run(y, x + from, x + to);
        bits = bits >> to << to;
      }
    }
    if (begin >= 0) *out++ = run(y, begin, next_x);
    sink.count += static_cast<std::size_t>(out - first);
  }

  static Run run(int y, int begin, int end) {
    return {static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(begin), static_cast<std::uint16_t>(end)};
  }

  std::size_t count_ = 0;
  std::size_t runs_ = 0;
  std::array<std::uint16_t, kMaxWords> x_;
  std::array<std::uint64_t, kMaxWords> bits_;
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
    }
  }

 private:
  static constexpr int kLeastRows = 16;

  RunSink& whole_;
  int rows_, count_, height_;
  std::array<RunSink, kCount> sinks_;
};

}  // namespace mocap::stages
