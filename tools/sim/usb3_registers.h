#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <string>
#include <vector>

namespace mocap::sim {

/// The memory of a USB3 Vision camera as its client sees it: bootstrap registers, features, and the GenICam file that
/// tells what they are. Does not know what carries the commands. Any thread.
///
/// Source: GenCP 1.3 (commands, ABRM, manifest); USB3 Vision 1.0.1 (SBRM, SIRM).
class Usb3Registers {
 public:
  struct Settings {
    std::string serial;
    std::uint32_t width_px = 640, height_px = 480;
    double rate_hz = 60.0;
    double exposure_us = 500.0;
  };

  /// What the client has chosen.
  struct Layout {
    std::uint32_t pixel_format = 0;  ///< GenICam PFNC
    std::uint32_t width_px = 0, height_px = 0, left_px = 0, top_px = 0;
    std::uint64_t payload_bytes = 0;
  };
  enum class Trigger { Free, Software, Line };

  /// Longest command that is taken, and longest acknowledge that is given, bytes.
  static constexpr std::size_t kMostCommand_bytes = 1024;
  static constexpr std::size_t kMostAcknowledge_bytes = 16384;

  explicit Usb3Registers(const Settings& settings);

  /// Does what a command says and writes the acknowledge into `room`; how long that is, and 0 for what is no command or
  /// wants no answer. Refuses addresses that are not there, what cannot be written, and sizes off a sensor.
  std::size_t answer(std::span<const std::byte> command, std::span<std::byte> room);

  /// Whether the client wants images now: the acquisition and the stream channel are both on.
  bool streaming() const;
  /// The client is gone: as after power-up, but for what it set.
  void unplugged();

  Layout layout() const;
  double rate_hz() const;
  double exposure_us() const;
  Trigger trigger() const;
  /// Whether a software trigger waits; it is taken.
  bool take_software_trigger();

 private:
  template <class T>
  T get(std::size_t address) const;
  template <class T>
  void put(std::size_t address, T value);
  void put_text(std::size_t address, const std::string& text);
  void put_bootstrap(const Settings& settings, std::size_t xml_bytes);
  std::uint16_t read(std::uint64_t address, std::span<std::byte> into) const;
  std::uint16_t write(std::uint64_t address, std::span<const std::byte> data);
  bool believable() const;
  void follow(std::uint64_t address);
  std::uint64_t payload_bytes() const;

  mutable std::mutex mutex_;
  std::vector<std::byte> memory_;
  bool triggered_ = false;
};

/// The GenICam description of the registers.
std::string usb3_description(std::uint32_t width_px, std::uint32_t height_px);

}  // namespace mocap::sim
