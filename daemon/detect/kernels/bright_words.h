#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace mocap::detect {

inline constexpr int words_of(int width_px) { return (width_px + 63) / 64; }

/// 64 pixels of a row; a set bit is a bright pixel.
struct BrightWord {
  std::uint64_t bits = 0;
  std::uint32_t place = 0;  ///< index of the word, see WordPlaces
};

/// Indices of the words of an image, row by row. Three indices between two rows are unused, so that reading one or two
/// words beyond a row never reads another row.
class WordPlaces {
 public:
  explicit WordPlaces(int width_px) : pitch_(words_of(width_px) + kGap) {}

  std::uint32_t of(int y, int word) const { return static_cast<std::uint32_t>(y * pitch_ + word); }
  int pitch() const { return pitch_; }
  int y(const BrightWord& word) const { return static_cast<int>(word.place) / pitch_; }
  /// The x of the first pixel of a word in row y.
  int x(const BrightWord& word, int y) const { return 64 * (static_cast<int>(word.place) - y * pitch_); }

 private:
  static constexpr int kGap = 3;
  int pitch_;
};

/// Number of runs that begin in the word that follows `last`; a run may continue from `last`.
inline std::size_t runs_begun(const BrightWord& last, const BrightWord& word) {
  const std::uint64_t goes_on = last.place + 1 == word.place ? last.bits >> 63U : 0;
  return static_cast<std::size_t>(std::popcount(word.bits & ~(word.bits << 1U | goes_on)));
}

/// The words of an image that have a bright pixel, in the order of rows and x. The image has four parts, one above
/// another, each with a buffer. The parts are read in turns, row by row, because memory delivers several streams faster
/// than a single stream.
class BrightWords {
 public:
  static constexpr int kParts = 4;

  /// Has capacity for an image that is bright everywhere; `room` outlives this object.
  BrightWords(std::span<BrightWord> room, int width_px, int height_px)
      : places_(width_px), part_rows_((height_px + kParts - 1) / kParts), rows_(height_px) {
    const std::size_t share = static_cast<std::size_t>(part_rows_) * static_cast<std::size_t>(words_of(width_px));
    for (std::size_t i = 0; i < kParts; ++i) first_[i] = end_[i] = room.data() + i * share;
  }
  static std::size_t room_for(int width_px, int height_px) {
    const int rows = (height_px + kParts - 1) / kParts * kParts;
    return static_cast<std::size_t>(rows) * static_cast<std::size_t>(words_of(width_px));
  }

  const WordPlaces& places() const { return places_; }
  int rows() const { return rows_; }
  int part_rows() const { return part_rows_; }
  int part_of(int y) const { return y / part_rows_; }

  void clear() {
    end_ = first_;
    max_words_in_row_ = 0;
  }
  /// The position of a part's next word: the caller writes there, and advances the pointer.
  BrightWord*& end(int part) { return end_[static_cast<std::size_t>(part)]; }
  /// The largest number of bright words in a row.
  std::size_t max_words_in_row() const { return max_words_in_row_; }
  void count_row(const BrightWord* begin, const BrightWord* end) {
    max_words_in_row_ = std::max(max_words_in_row_, static_cast<std::size_t>(end - begin));
  }
  std::span<BrightWord> part(int i) const {
    const auto at = static_cast<std::size_t>(i);
    return {first_[at], end_[at]};
  }

 private:
  WordPlaces places_;
  int part_rows_, rows_;
  std::array<BrightWord*, kParts> first_{}, end_{};
  std::size_t max_words_in_row_ = 0;
};

}  // namespace mocap::detect
