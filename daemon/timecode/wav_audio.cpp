#include "timecode/wav_audio.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <thread>
#include <utility>

#include "timecode/wav_file.h"

namespace mocap::timecode {
namespace {

constexpr double kBlock_s = 0.01;

class WavAudio final : public AudioSource {
 public:
  explicit WavAudio(TimecodeSettings settings)
      : settings_(std::move(settings)), name_(fmt::format("file '{}'", settings_.wav.string())) {}

  Result<AudioBlock> next(Duration patience) override {
    if (!file_ && !ended_) {
      if (const Status opened = open(); !opened) return wait(patience, opened.error());
    }
    if (ended_) return wait(patience, {ErrorCode::EndOfStream, fmt::format("{} has ended", name_)});
    const auto wanted = static_cast<std::size_t>(kBlock_s * file_->rate_hz());
    const Timestamp due = at(samples_ + wanted);  // a device has the block when its last sample was recorded
    if (due - host_now() > patience) return wait(patience, {ErrorCode::Timeout, "no samples yet"});
    std::this_thread::sleep_for(due - host_now());
    const std::span<const std::int16_t> samples = file_->read(wanted);
    const AudioBlock block{samples, at(samples_), file_->rate_hz()};
    samples_ += samples.size();
    ended_ = samples.size() < wanted;
    return block;
  }

  const std::string& name() const override { return name_; }

 private:
  Status open() {
    Result<WavFile> file = WavFile::open(settings_.wav, settings_.channel);
    if (!file) return file.error();
    file_ = std::move(*file);
    begun_at_ = host_now();
    return {};
  }

  Timestamp at(std::uint64_t sample) const {
    return begun_at_ + from_s(static_cast<double>(sample) / file_->rate_hz());
  }

  static Error wait(Duration patience, Error error) {
    std::this_thread::sleep_for(patience);
    return error;
  }

  TimecodeSettings settings_;
  std::string name_;
  std::optional<WavFile> file_;
  Timestamp begun_at_;
  std::uint64_t samples_ = 0;
  bool ended_ = false;
};

}  // namespace

std::unique_ptr<AudioSource> make_wav_audio(const TimecodeSettings& settings) {
  return std::make_unique<WavAudio>(settings);
}

}  // namespace mocap::timecode
