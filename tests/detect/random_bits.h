#pragma once

#include <algorithm>
#include <cstddef>
#include <random>
#include <utility>
#include <vector>

#include "detect/kernels/bright_words.h"
#include "detect/kernels/detect_kernels.h"

namespace mocap::detect {

/// A binary image, and its components by flood fill: the oracle of the component tests.
struct BinaryImage {
  BinaryImage(int width, int height)
      : width_px(width), height_px(height), pixels(static_cast<std::size_t>(width * height)) {}

  bool at(int x, int y) const {
    return x >= 0 && x < width_px && y >= 0 && y < height_px && pixels[static_cast<std::size_t>(y * width_px + x)];
  }
  void set(int x, int y, bool bright = true) {
    if (x >= 0 && x < width_px && y >= 0 && y < height_px) pixels[static_cast<std::size_t>(y * width_px + x)] = bright;
  }
  void add_box(int x0, int y0, int width, int height) {
    for (int y = y0; y < y0 + height; ++y) {
      for (int x = x0; x < x0 + width; ++x) set(x, y);
    }
  }

  /// The runs of all rows, in the order of rows, then x.
  std::vector<Run> runs() const {
    std::vector<Run> all;
    for (int y = 0; y < height_px; ++y) {
      for (int x = 0; x < width_px; ++x) {
        if (!at(x, y) || at(x - 1, y)) continue;
        int end = x;
        while (at(end, y)) ++end;
        all.push_back({static_cast<std::uint16_t>(y), static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(end)});
      }
    }
    return all;
  }
  /// The words with a bright pixel, in the order of rows, then x.
  std::vector<BrightWord> words() const {
    const WordPlaces places(width_px);
    std::vector<BrightWord> all;
    for (int y = 0; y < height_px; ++y) {
      for (int word = 0; word < words_of(width_px); ++word) {
        std::uint64_t bits = 0;
        for (int bit = 0; bit < 64; ++bit) bits |= static_cast<std::uint64_t>(at(64 * word + bit, y)) << bit;
        if (bits != 0) all.push_back({bits, places.of(y, word)});
      }
    }
    return all;
  }

  int width_px, height_px;
  std::vector<bool> pixels;
};

/// The runs of an 8-connected component, by row, then x.
using FloodedComponent = std::vector<Run>;

/// The components of an image, in the order of their first pixel.
inline std::vector<FloodedComponent> flood(BinaryImage image) {
  std::vector<FloodedComponent> all;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) {
      if (!image.at(x, y)) continue;
      BinaryImage component(image.width_px, image.height_px);
      std::vector<std::pair<int, int>> open{{x, y}};
      image.set(x, y, false);
      while (!open.empty()) {
        const auto [at_x, at_y] = open.back();
        open.pop_back();
        component.set(at_x, at_y);
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) {
            if (!image.at(at_x + dx, at_y + dy)) continue;
            image.set(at_x + dx, at_y + dy, false);
            open.emplace_back(at_x + dx, at_y + dy);
          }
        }
      }
      all.push_back(component.runs());
    }
  }
  return all;
}

inline int area_px2(const FloodedComponent& component) {
  int area = 0;
  for (const Run& run : component) area += run.end - run.begin;
  return area;
}

/// Boxes, lines, single pixels and noise, at any place of the image.
inline BinaryImage random_image(std::mt19937& random, int width_px, int height_px) {
  BinaryImage image(width_px, height_px);
  const auto below = [&](int end) { return static_cast<int>(random() % static_cast<unsigned>(std::max(1, end))); };
  for (int i = below(20); i > 0; --i) image.add_box(below(width_px), below(height_px), 1 + below(12), 1 + below(8));
  for (int i = below(6); i > 0; --i) image.add_box(below(width_px), below(height_px), 1 + below(120), 1);
  for (int i = below(4); i > 0; --i) {
    int x = below(width_px);
    for (int y = below(height_px), end = y + below(height_px); y < end; ++y, x += below(3) - 1) image.set(x, y);
  }
  for (int i = below(width_px * height_px / 20); i > 0; --i) image.set(below(width_px), below(height_px));
  return image;
}

inline bool operator==(const Run& a, const Run& b) { return a.y == b.y && a.begin == b.begin && a.end == b.end; }

}  // namespace mocap::detect
