#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/expects.h"
#include "fuzz/fuzz_arguments.h"
#include "fuzz/inputs.h"
#include "model/clock/timecode.h"
#include "support/temporary_folder.h"
#include "timecode/ltc_follower.h"
#include "timecode/ltc_signal.h"
#include "timecode/wav_bytes.h"
#include "timecode/wav_file.h"

// Fuzzes linear timecode: WAV files with bytes changed, removed and repeated, and their sound in blocks of any size to
// the decoder and its clock. Each file must be read or refused with a reason. The decoded frames are in the order of
// their times, and the clock and its state are finite.
//
// usage: timecode_fuzz [COUNT [SEED]]

namespace mocap::timecode {
namespace {

using fuzz::Inputs;

class Fuzz {
 public:
  explicit Fuzz(std::uint64_t seed) : files_(Inputs::Kind::Binary, seed, files()) {}

  void try_once() {
    const auto path = folder_.write("sound.wav", files_.next());
    auto wav = WavFile::open(path, 1 + static_cast<int>(files_.below(3)));
    if (!wav) {
      MOCAP_EXPECTS(!wav.error().message.empty());
      return;
    }
    MOCAP_EXPECTS(wav->rate_hz() >= 8000.0 && wav->rate_hz() <= 384'000.0);
    TimecodeSettings settings;
    settings.format = testing::with_rate(files_.below(2) == 0 ? 25 : 30, files_.below(2) == 0, files_.below(2) == 0);
    LtcFollower follower(settings, "sound", files_.below(2) == 0 ? 0.0 : 100.0);
    LtcDecoder decoder(rate_hz(settings.format));
    Timestamp at = testing::kBegin;
    for (auto samples = wav->read(1 + files_.below(3000)); !samples.empty();
         samples = wav->read(1 + files_.below(3000))) {
      const AudioBlock block{samples, at, wav->rate_hz()};
      follower.add(block);
      decoded_ += decoder.decode(block).size();
      at += from_s(static_cast<double>(samples.size()) / wav->rate_hz());
      const TimecodeHealth health = follower.state(at);
      MOCAP_EXPECTS(std::isfinite(health.drift_ppm));
    }
  }

  std::uint64_t decoded() const { return decoded_; }

 private:
  // Sound of all widths and of two channels.
  static std::vector<std::string> files() {
    const testing::Samples samples = testing::ltc(testing::at(testing::with_rate(25), 10, 0, 0, 3), 8);
    testing::Samples reverse = testing::ltc(testing::at(testing::with_rate(30), 1, 2, 3, 9), 6, 1e-3, -1);
    testing::add_noise(reverse, 0.1, 3);
    std::string floats, stereo;
    for (const std::int16_t sample : samples) {
      testing::put(floats, static_cast<float>(sample) / 32768.0F);
      testing::put(stereo, sample);
      testing::put(stereo, std::int16_t{0});
    }
    return {testing::wav(samples), testing::wav(reverse), testing::wav(3, 1, 48'000, 32, floats),
            testing::wav(1, 2, 48'000, 16, stereo)};
  }

  support::TemporaryFolder folder_;
  Inputs files_;
  std::uint64_t decoded_ = 0;
};

// A text is refused, or is a timecode that is written and read alike.
void read_text(const std::string& text) {
  const Timecode format = testing::with_rate(25);
  const auto read = parse_timecode(text, format);
  if (!read) return;
  MOCAP_EXPECTS(is_valid(*read));
  MOCAP_EXPECTS(parse_timecode(text_of(*read), format) == read);
}

}  // namespace
}  // namespace mocap::timecode

int main(int argc, char** argv) {
  const mocap::fuzz::Arguments arguments(argc, argv);
  mocap::timecode::Fuzz fuzz(arguments.seed);
  mocap::fuzz::Inputs texts(mocap::fuzz::Inputs::Kind::Text, arguments.seed, {"01:02:03:04", "23:59:59:24"});
  for (std::uint64_t i = 0; i < arguments.count; ++i) {
    fuzz.try_once();
    mocap::timecode::read_text(texts.next());
  }
  arguments.print("sounds");
  return fuzz.decoded() > 0 ? 0 : 1;
}
