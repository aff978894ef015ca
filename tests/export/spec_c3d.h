#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

namespace mocap::exports::testing {

/// A reader of C3D files that follows the manual of c3d.org and knows nothing of the writer. Intel byte order and
/// floating-point positions only. Throws std::runtime_error where the file breaks a rule of the manual.
class SpecC3d {
 public:
  struct Parameter {
    int type = 0;
    std::vector<std::size_t> dimensions;
    std::string data, about;

    std::size_t count() const {
      std::size_t n = 1;
      for (const std::size_t d : dimensions) n *= d;
      return n;
    }
    int integer(std::size_t i = 0) const {
      const auto low = static_cast<std::uint8_t>(data.at(2 * i)), high = static_cast<std::uint8_t>(data.at(2 * i + 1));
      return low | high << 8;
    }
    float real(std::size_t i = 0) const {
      float value = 0.0F;
      std::memcpy(&value, data.substr(4 * i, 4).data(), 4);
      return value;
    }
    std::string text(std::size_t i = 0) const {
      const std::size_t width = dimensions.at(0);
      std::string value = data.substr(i * width, width);
      value.erase(value.find_last_not_of(' ') + 1);
      return value;
    }
  };
  struct Point {
    float x, y, z;
    int residual, cameras;  // -1: no position
  };

  explicit SpecC3d(std::string file) : file_(std::move(file)) {
    require(file_.size() % 512 == 0, "the file is a number of blocks");
    require(byte(1) == 0x50, "the key is 0x50");
    read_parameters(512U * (byte(0) - 1U));
    read_points();
  }

  int header_word(std::size_t number) const { return byte(2 * number - 2) | byte(2 * number - 1) << 8; }
  float header_real(std::size_t number) const {
    float value = 0.0F;
    std::memcpy(&value, file_.data() + 2 * number - 2, 4);
    return value;
  }
  std::string header_text(std::size_t number, std::size_t size) const { return file_.substr(2 * number - 2, size); }
  const Parameter& operator[](const std::string& name) const {
    const auto found = parameters_.find(name);
    if (found == parameters_.end()) throw std::runtime_error("no parameter " + name);
    return found->second;
  }
  bool has(const std::string& name) const { return parameters_.count(name) > 0; }
  std::vector<std::string> labels(const std::string& what = "LABELS") const {
    std::vector<std::string> all;
    for (int part = 1; part == 1 || has("POINT:" + what + std::to_string(part)); ++part) {
      const Parameter& some = (*this)["POINT:" + what + (part == 1 ? "" : std::to_string(part))];
      for (std::size_t i = 0; i < some.dimensions.at(1); ++i) all.push_back(some.text(i));
    }
    return all;
  }
  std::size_t frames() const { return frames_; }
  const Point& point(std::size_t frame, std::size_t label) const { return points_.at(frame * used_ + label); }

 private:
  static void require(bool holds, const char* rule) {
    if (!holds) throw std::runtime_error(std::string("C3D rule broken: ") + rule);
  }
  std::uint8_t byte(std::size_t at) const { return static_cast<std::uint8_t>(file_.at(at)); }

  void read_parameters(std::size_t begin) {
    const std::size_t end = begin + 512U * byte(begin + 2);
    require(byte(begin + 3) == 84, "processor 84: Intel");
    std::map<int, std::string> groups;
    for (std::size_t at = begin + 4;;) {
      const std::size_t name_size = byte(at);
      if (name_size == 0) break;
      const int id = static_cast<std::int8_t>(byte(at + 1));
      const std::string name = file_.substr(at + 2, name_size);
      const std::size_t pointer = at + 2 + name_size, next = byte(pointer) | byte(pointer + 1) << 8;
      require(next < 32768, "offsets fit into a signed word");
      std::size_t after = pointer + 2;
      if (id < 0) {
        groups[-id] = name;
        after += 1U + byte(after);
      } else {
        Parameter p;
        p.type = static_cast<std::int8_t>(byte(after));
        for (std::size_t d = 0; d < byte(after + 1); ++d) p.dimensions.push_back(byte(after + 2 + d));
        after += 2 + p.dimensions.size();
        p.data = file_.substr(after, p.count() * static_cast<std::size_t>(std::abs(p.type)));
        after += p.data.size();
        p.about = file_.substr(after + 1, byte(after));
        after += 1 + p.about.size();
        require(groups.count(id) > 0, "a group precedes its parameters");
        parameters_[groups[id] + ":" + name] = p;
      }
      require(after <= end, "parameters end within their section");
      if (next == 0) break;
      require(pointer + next == after, "the offset points to the next record");
      at = pointer + next;
    }
  }

  void read_points() {
    used_ = static_cast<std::size_t>((*this)["POINT:USED"].integer());
    require(static_cast<int>(used_) == header_word(2), "POINT:USED equals header word 2");
    require((*this)["POINT:DATA_START"].integer() == header_word(9), "DATA_START equals header word 9");
    require((*this)["POINT:SCALE"].real() < 0.0F, "floating-point positions");
    require((*this)["POINT:SCALE"].real() == header_real(7), "SCALE equals header word 7");
    require((*this)["POINT:RATE"].real() == header_real(11), "RATE equals header word 11");
    require(header_word(3) == 0, "no analog values");
    frames_ = static_cast<std::size_t>((*this)["POINT:FRAMES"].integer());
    if (frames_ == 65535 && has("POINT:LONG_FRAMES")) {
      frames_ = static_cast<std::size_t>((*this)["POINT:LONG_FRAMES"].real());
    }
    std::size_t at = 512U * (static_cast<std::size_t>(header_word(9)) - 1U);
    require(at + frames_ * used_ * 16 <= file_.size(), "all frames are in the file");
    require(file_.size() - at - frames_ * used_ * 16 < 512, "nothing follows the frames");
    for (std::size_t i = 0; i < frames_ * used_; ++i, at += 16) {
      float words[4];
      std::memcpy(words, file_.data() + at, 16);
      const auto word = static_cast<std::int16_t>(words[3]);
      points_.push_back({words[0], words[1], words[2], word < 0 ? -1 : word & 0xFF, word < 0 ? 0 : word >> 8});
    }
  }

  std::string file_;
  std::map<std::string, Parameter> parameters_;
  std::size_t used_ = 0, frames_ = 0;
  std::vector<Point> points_;
};

}  // namespace mocap::exports::testing
