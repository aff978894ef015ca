#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "stages/detect_kernels.h"

namespace mocap::stages {

inline constexpr std::size_t kMaxWords = 32768 / 64;

/// The bright pixels of one row: words of 64 bits, those without any left out. Written to need few branches: which rows
/// and words are bright no processor foresees, and each surprise costs as much as reading a thousand pixels.
class BrightWords {
 public:
  BrightWords() {
    x_[0] = kNowhere;
    bits_[0] = 0;
  }

  /// `bits` of the pixels from x on, x a multiple of 64; in the order of x.
  void add(int x, std::uint64_t bits) {
    x_[count_ + 1] = static_cast<std::uint16_t>(x);
    bits_[count_ + 1] = bits;
    runs_ += static_cast<std::size_t>(std::popcount(bits & ~shifted(count_ + 1)));
    count_ += bits != 0 ? 1 : 0;
  }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = runs_ = 0; }

  /// Hands the row's runs on, or gives the row up.
  void flush(int y, RunSink& sink) {
    if (runs_ > sink.row_bound || runs_ > sink.room.size() - sink.count) {
      ++sink.rows_given_up;
    } else {
      emit(y, sink.room.data() + sink.count);
      sink.count += runs_;
    }
    clear();
  }

 private:
  static constexpr std::uint16_t kNowhere = 1;  // no word adjoins it

  bool adjoins(std::size_t i) const { return x_[i - 1] + 64 == x_[i]; }

  /// Word i, each bit one further, with the last bit of the word before.
  std::uint64_t shifted(std::size_t i) const {
    const std::uint64_t carry = adjoins(i) ? bits_[i - 1] >> 63U : 0U;
    return bits_[i] << 1U | carry;
  }

  void emit(int y, Run* out) const {
    Run* begun = out;
    Run* ended = out;
    for (std::size_t i = 1; i <= count_; ++i) {
      // A run that reaches the end of a word goes on in the next one, where there is one.
      if ((bits_[i - 1] >> 63U) != 0 && !adjoins(i)) (ended++)->end = static_cast<std::uint16_t>(x_[i - 1] + 64);
      const std::uint64_t bits = bits_[i], before = shifted(i);
      for (std::uint64_t begins = bits & ~before; begins != 0; begins &= begins - 1, ++begun) {
        begun->y = static_cast<std::uint16_t>(y);
        begun->begin = static_cast<std::uint16_t>(x_[i] + std::countr_zero(begins));
      }
      for (std::uint64_t ends = before & ~bits; ends != 0; ends &= ends - 1) {
        (ended++)->end = static_cast<std::uint16_t>(x_[i] + std::countr_zero(ends));
      }
    }
    if ((bits_[count_] >> 63U) != 0) ended->end = static_cast<std::uint16_t>(x_[count_] + 64);
  }

  std::size_t count_ = 0;
  std::size_t runs_ = 0;
  // From 1 on; one more, for a word without any.
  std::array<std::uint16_t, kMaxWords + 2> x_;
  std::array<std::uint64_t, kMaxWords + 2> bits_;
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
