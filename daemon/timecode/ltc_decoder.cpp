#include "timecode/ltc_decoder.h"

#include <ltc.h>

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::timecode {
namespace {

// Frames that wait in libltc: those of one block.
constexpr int kQueue = 32;
// A block of more samples is decoded in parts, so that the queue suffices: 32 frames are over 1 s.
constexpr std::size_t kPart = 8192;

struct FreeDecoder {
  void operator()(LTCDecoder* decoder) const noexcept { ltc_decoder_free(decoder); }
};

Timecode timecode_in(LTCFrameExt& frame) {
  SMPTETimecode read{};
  ltc_frame_to_time(&read, &frame.ltc, 0);
  Timecode timecode;
  timecode.hours = read.hours;
  timecode.minutes = read.mins;
  timecode.seconds = read.secs;
  timecode.frames = read.frame;
  timecode.drop_frame = frame.ltc.dfbit != 0;
  return timecode;
}

}  // namespace

struct LtcDecoder::Impl {
  double frames_per_second = 30.0;
  double rate_hz = 0.0;  // of the samples
  std::unique_ptr<LTCDecoder, FreeDecoder> decoder;
  ltc_off_t samples = 0;  // before the current part
  std::vector<LtcFrame> frames;

  void open(double samples_per_second) {
    rate_hz = samples_per_second;
    decoder.reset(ltc_decoder_create(static_cast<int>(std::lround(rate_hz / frames_per_second)), kQueue));
    MOCAP_EXPECTS(decoder != nullptr);
    samples = 0;
  }

  void decode(std::span<const std::int16_t> part, Timestamp first_at) {
    // libltc takes non-const samples and does not change them.
    ltc_decoder_write_s16(decoder.get(), const_cast<short*>(part.data()), part.size(), samples);  // NOLINT
    LTCFrameExt found{};
    while (ltc_decoder_read(decoder.get(), &found) > 0) {
      const auto after = static_cast<double>(found.off_start - samples);
      frames.push_back({timecode_in(found), first_at + from_s(after / rate_hz), found.reverse != 0});
    }
    samples += static_cast<ltc_off_t>(part.size());
  }
};

LtcDecoder::LtcDecoder(double frames_per_second) : impl_(std::make_unique<Impl>()) {
  MOCAP_EXPECTS(frames_per_second > 0.0);
  impl_->frames_per_second = frames_per_second;
}

LtcDecoder::~LtcDecoder() = default;

std::span<const LtcFrame> LtcDecoder::decode(const AudioBlock& block) {
  impl_->frames.clear();
  if (!(block.rate_hz > 0.0)) return {};
  if (block.rate_hz != impl_->rate_hz) impl_->open(block.rate_hz);
  for (std::size_t begin = 0; begin < block.samples.size(); begin += kPart) {
    const auto part = block.samples.subspan(begin, std::min(kPart, block.samples.size() - begin));
    impl_->decode(part, block.first_at + from_s(static_cast<double>(begin) / block.rate_hz));
  }
  return impl_->frames;
}

}  // namespace mocap::timecode
