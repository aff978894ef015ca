#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "base/expects.h"
#include "support/places.h"

namespace mocap::fuzz {

inline std::string bytes_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  MOCAP_EXPECTS(in.good());
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The files of a folder of the source tree with this extension (empty: all), in the order of their names.
inline std::vector<std::string> files_in(const std::string& folder, const std::string& extension = "") {
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(support::source_folder() + "/" + folder)) {
    if (entry.is_regular_file() && (extension.empty() || entry.path().extension() == extension)) {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<std::string> files;
  for (const auto& path : paths) files.push_back(bytes_of(path));
  return files;
}

/// A copy in a block of its exact size: the address sanitizer detects reads beyond its end.
class Exact {
 public:
  explicit Exact(const std::string& bytes) : size_(bytes.size()), block_(new char[bytes.size()]) {
    bytes.copy(block_.get(), size_);
  }
  std::string_view text() const { return {block_.get(), size_}; }
  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(block_.get(), size_)); }

 private:
  std::size_t size_;
  std::unique_ptr<char[]> block_;
};

/// Inputs of a parser: first the valid seeds as they are, then seeds with up to six damages, which follow from a
/// number.
class Inputs {
 public:
  enum class Kind { Text, Binary };

  Inputs(Kind kind, std::uint64_t seed, std::vector<std::string> seeds)
      : kind_(kind), random_(seed), seeds_(std::move(seeds)) {
    MOCAP_EXPECTS(!seeds_.empty());
  }

  std::size_t below(std::size_t end) { return end == 0 ? 0 : random_() % end; }

  std::string next() {
    if (made_ < seeds_.size()) return seeds_[made_++];
    std::string input = any_seed();
    for (std::size_t times = 1 + below(6); times > 0 && !input.empty(); --times) {
      kind_ == Kind::Text&& below(4) != 0 ? damage_text(input) : damage_bytes(input);
    }
    return input;
  }

 private:
  const std::string& any_seed() { return seeds_[below(seeds_.size())]; }

  void damage_bytes(std::string& bytes) {
    const std::size_t at = below(bytes.size());
    switch (below(9)) {
      case 0: bytes[at] = static_cast<char>(random_()); break;
      case 1: bytes[at] = static_cast<char>(static_cast<unsigned char>(bytes[at]) ^ (1U << below(8))); break;
      case 2: bytes.erase(at, 1 + below(30)); break;
      case 3: bytes.insert(at, bytes, below(bytes.size()), below(60)); break;
      case 4: bytes.insert(at, random_bytes(8)); break;
      case 5:
        if (below(4) == 0) bytes.resize(at);
        break;
      case 6: {
        const std::string& other = any_seed();
        bytes.replace(at, below(80), other, below(other.size()), below(80));
        break;
      }
      default: put_number(bytes, at);
    }
  }

  // Numbers at the bounds of their type, in either byte order.
  void put_number(std::string& bytes, std::size_t at) {
    static constexpr std::uint32_t kBounds[] = {0,          1,          2,          0x7F,       0x80,
                                                0xFF,       0x100,      0x7FFF,     0x8000,     0xFFFF,
                                                0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FC00000, 0x7F800000};
    const std::uint32_t number = kBounds[below(std::size(kBounds))];
    const std::size_t size = std::size_t{1} << below(3);
    const bool big = below(2) == 0;
    for (std::size_t i = 0; i < size && at + i < bytes.size(); ++i) {
      bytes[at + i] = static_cast<char>(number >> (8 * (big ? size - 1 - i : i)));
    }
  }

  void damage_text(std::string& text) {
    const std::size_t at = below(text.size());
    const std::size_t line = text.rfind('\n', at) + 1;  // npos + 1 is 0: the first line
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    switch (below(7)) {
      case 0: text.erase(line, end - line); break;
      case 1: text.insert(line, text.substr(line, end - line)); break;
      case 2: uncomment(text, line); break;
      case 3: {
        const std::string& other = any_seed();
        const std::size_t from = other.rfind('\n', below(other.size())) + 1;
        text.insert(line, other, from, other.find('\n', from) - from + 1);
        break;
      }
      case 4: replace_quoted(text, at); break;
      default: replace_number(text, at);
    }
  }

  // "# key = 1" becomes "key = 1": most keys of the shipped configuration are comments.
  static void uncomment(std::string& text, std::size_t line) {
    if (text[line] == '#') text.erase(line, text[line + 1] == ' ' ? 2 : 1);
  }

  void replace_number(std::string& text, std::size_t at) {
    static constexpr const char* kOdd[] = {"0",      "-1",         "1e308",
                                           "-1e308", "1e-320",     "nan",
                                           "inf",    "-inf",       "0.0",
                                           "-0.0",   "2147483648", "18446744073709551616",
                                           "[]",     "{}",         "\"\"",
                                           "true",   "[[1]]",      "1e999",
                                           "65536",  "1_0",        "0x7fffffffffffffff"};
    const std::size_t first = text.find_first_of("0123456789", at);
    if (first == std::string::npos) return;
    const std::size_t behind = text.find_first_not_of("0123456789.eE+-", first);
    text.replace(first, std::min(behind, text.size()) - first, kOdd[below(std::size(kOdd))]);
  }

  void replace_quoted(std::string& text, std::size_t at) {
    const std::size_t first = text.find('"', at);
    const std::size_t second = first == std::string::npos ? first : text.find('"', first + 1);
    if (second == std::string::npos) return;
    static constexpr const char* kOdd[] = {"",    ".",           "..",       "/",       "../../../../etc/passwd",
                                           "a b", "\xff\xfe",    "\\n",      "\\u0000", "*",
                                           "nan", "caf\xc3\xa9", "/dev/null"};
    const std::size_t odd = below(std::size(kOdd) + 1);
    text.replace(first + 1, second - first - 1,
                 odd == std::size(kOdd) ? std::string(1 + below(3000), 'n') : std::string(kOdd[odd]));
  }

  std::string random_bytes(std::size_t most) {
    std::string bytes(below(most), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random_());
    return bytes;
  }

  Kind kind_;
  std::mt19937_64 random_;
  std::vector<std::string> seeds_;
  std::size_t made_ = 0;
};

}  // namespace mocap::fuzz
