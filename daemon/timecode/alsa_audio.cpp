#include "timecode/alsa_audio.h"

#include <alsa/asoundlib.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <thread>
#include <utility>
#include <vector>

namespace mocap::timecode {
namespace {

constexpr unsigned kRate_hz = 48'000;
constexpr snd_pcm_uframes_t kPeriod = 480;     // 10 ms
constexpr snd_pcm_uframes_t kBuffer = 24'000;  // 0.5 s: the thread may be late
constexpr Duration kReopenAfter = std::chrono::seconds(1);

struct ClosePcm {
  void operator()(snd_pcm_t* pcm) const noexcept { snd_pcm_close(pcm); }
};

// ALSA prints to stderr otherwise; its error codes tell the same.
void print_nothing(const char* /*file*/, int /*line*/, const char* /*function*/, int /*error*/, const char* /*format*/,
                   ...) {}  // NOLINT(cert-dcl50-cpp): the type of ALSA's handler

ErrorCode code_of(int error) {
  switch (-error) {
    case ENOENT:
    case ENODEV: return ErrorCode::NotFound;
    case EBUSY: return ErrorCode::Busy;
    default: return ErrorCode::Io;
  }
}

class AlsaAudio final : public AudioSource {
 public:
  explicit AlsaAudio(TimecodeSettings settings)
      : settings_(std::move(settings)), name_(fmt::format("device '{}'", settings_.device)) {
    snd_lib_error_set_handler(print_nothing);
  }

  Result<AudioBlock> next(Duration patience) override {
    if (!pcm_) {
      if (host_now() < open_at_) return wait(patience, failure_);
      if (const Status opened = open(); !opened) {
        open_at_ = host_now() + kReopenAfter;
        failure_ = opened.error();
        return wait(patience, failure_);
      }
    }
    const auto patience_ms = static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(patience).count());
    const int ready = snd_pcm_wait(pcm_.get(), std::max(1, patience_ms));
    if (ready == 0) return Error{ErrorCode::Timeout, fmt::format("{} delivers no sound", name_)};
    if (ready < 0) return recover(ready);
    return read();
  }

  const std::string& name() const override { return name_; }

 private:
  Status fail(const char* what, int error) {
    pcm_.reset();
    return Error{code_of(error), fmt::format("{}: {}: {}", name_, what, snd_strerror(error))};
  }

  Status open() {
    snd_pcm_t* opened = nullptr;
    if (const int error = snd_pcm_open(&opened, settings_.device.c_str(), SND_PCM_STREAM_CAPTURE, SND_PCM_NONBLOCK);
        error < 0) {
      return fail("cannot be opened", error);
    }
    pcm_.reset(opened);
    if (const Status set = set_hardware(); !set) return set;
    if (const Status set = set_software(); !set) return set;
    if (const int error = snd_pcm_start(opened); error < 0) return fail("cannot start", error);
    return {};
  }

  Status set_hardware() {
    snd_pcm_hw_params_t* wanted = nullptr;
    snd_pcm_hw_params_alloca(&wanted);
    snd_pcm_t* pcm = pcm_.get();
    channels_ = static_cast<unsigned>(settings_.channel);
    rate_hz_ = kRate_hz;
    snd_pcm_uframes_t period = kPeriod, buffer = kBuffer;
    int error = snd_pcm_hw_params_any(pcm, wanted);
    if (error >= 0) error = snd_pcm_hw_params_set_access(pcm, wanted, SND_PCM_ACCESS_RW_INTERLEAVED);
    if (error >= 0) error = snd_pcm_hw_params_set_format(pcm, wanted, SND_PCM_FORMAT_S16_LE);
    if (error >= 0) error = snd_pcm_hw_params_set_channels_near(pcm, wanted, &channels_);
    if (error >= 0) error = snd_pcm_hw_params_set_rate_near(pcm, wanted, &rate_hz_, nullptr);
    if (error >= 0) error = snd_pcm_hw_params_set_period_size_near(pcm, wanted, &period, nullptr);
    if (error >= 0) error = snd_pcm_hw_params_set_buffer_size_near(pcm, wanted, &buffer);
    if (error >= 0) error = snd_pcm_hw_params(pcm, wanted);
    if (error < 0) return fail("refuses 16 bits at 48 kHz; use \"plughw:...\"", error);
    if (channels_ < static_cast<unsigned>(settings_.channel)) {
      pcm_.reset();
      return Error{ErrorCode::InvalidArgument,
                   fmt::format("{} has {} channels, expected at least [timecode] channel = {}", name_, channels_,
                               settings_.channel)};
    }
    interleaved_.resize(buffer * channels_);
    samples_.reserve(buffer);
    return {};
  }

  // With times of the host's monotonic clock.
  Status set_software() {
    snd_pcm_sw_params_t* wanted = nullptr;
    snd_pcm_sw_params_alloca(&wanted);
    snd_pcm_t* pcm = pcm_.get();
    int error = snd_pcm_sw_params_current(pcm, wanted);
    if (error >= 0) error = snd_pcm_sw_params_set_tstamp_mode(pcm, wanted, SND_PCM_TSTAMP_ENABLE);
    if (error >= 0) error = snd_pcm_sw_params_set_tstamp_type(pcm, wanted, SND_PCM_TSTAMP_TYPE_MONOTONIC);
    if (error >= 0) error = snd_pcm_sw_params_set_avail_min(pcm, wanted, kPeriod);
    if (error >= 0) error = snd_pcm_sw_params(pcm, wanted);
    return error < 0 ? fail("gives no times", error) : Status{};
  }

  // The instant of the oldest sample in the buffer: `available` samples before the time at which that number was
  // measured.
  Timestamp oldest_at() const {
    snd_pcm_uframes_t available = 0;
    snd_htimestamp_t at{};
    const bool known = snd_pcm_htimestamp(pcm_.get(), &available, &at) >= 0 && (at.tv_sec != 0 || at.tv_nsec != 0);
    const Timestamp measured_at = known ? from_ns(at.tv_sec * 1'000'000'000LL + at.tv_nsec) : host_now();
    return measured_at - from_s(static_cast<double>(available) / rate_hz_);
  }

  Result<AudioBlock> read() {
    const Timestamp first_at = oldest_at();
    const snd_pcm_sframes_t count = snd_pcm_readi(
        pcm_.get(), interleaved_.data(), std::min<snd_pcm_uframes_t>(kBuffer, interleaved_.size() / channels_));
    if (count == -EAGAIN || count == 0) return Error{ErrorCode::Timeout, fmt::format("{} delivers no sound", name_)};
    if (count < 0) return recover(static_cast<int>(count));
    samples_.clear();
    for (snd_pcm_sframes_t i = 0; i < count; ++i) {
      samples_.push_back(
          interleaved_[static_cast<std::size_t>(i) * channels_ + static_cast<unsigned>(settings_.channel) - 1]);
    }
    return AudioBlock{samples_, first_at, static_cast<double>(rate_hz_)};
  }

  // After an overrun the recording starts again; after other errors the device is opened again.
  Error recover(int error) {
    const bool goes_on = snd_pcm_recover(pcm_.get(), error, 1) >= 0 && snd_pcm_start(pcm_.get()) >= 0;
    failure_ = {code_of(error), fmt::format("{}: {}", name_, snd_strerror(error))};
    if (!goes_on) {
      pcm_.reset();
      open_at_ = host_now() + kReopenAfter;
    }
    return failure_;
  }

  static Error wait(Duration patience, Error error) {
    std::this_thread::sleep_for(patience);
    return error;
  }

  TimecodeSettings settings_;
  std::string name_;
  std::unique_ptr<snd_pcm_t, ClosePcm> pcm_;
  unsigned channels_ = 1, rate_hz_ = kRate_hz;
  std::vector<std::int16_t> interleaved_, samples_;
  Timestamp open_at_;
  Error failure_{ErrorCode::NotFound, {}};
};

}  // namespace

std::unique_ptr<AudioSource> make_alsa_audio(const TimecodeSettings& settings) {
  return std::make_unique<AlsaAudio>(settings);
}

}  // namespace mocap::timecode
