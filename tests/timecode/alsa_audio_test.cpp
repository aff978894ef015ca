#include "timecode/alsa_audio.h"

#include <gtest/gtest.h>

#include "ltc_signal.h"
#include "support/temporary_folder.h"
#include "timecode/ltc_decoder.h"

namespace mocap::timecode {
namespace alsa_audio_test {

using testing::Samples;

// ALSA's own `file` plug-in delivers a raw file as a device, as fast as it is read.
TEST(AlsaAudio, DecodesTheSoundOfADevice) {
  const support::TemporaryFolder folder;
  const Samples samples = testing::ltc(testing::at(testing::with_rate(25), 10, 0, 0, 0), 250);
  const std::filesystem::path raw = folder.write(
      "ltc.raw", std::string(reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(samples[0])));
  const std::filesystem::path config = folder.write(
      "asound.conf", "</usr/share/alsa/alsa.conf>\npcm.ltc { type file slave.pcm null file /dev/null infile \"" +
                         raw.string() + "\" format raw }\n");
  ::setenv("ALSA_CONFIG_PATH", config.c_str(), 1);  // NOLINT(concurrency-mt-unsafe): before any thread
  TimecodeSettings settings;
  settings.device = "ltc";
  const std::unique_ptr<AudioSource> audio = make_alsa_audio(settings);
  LtcDecoder decoder(25.0);

  std::size_t frames = 0;
  Timestamp before{};
  for (int blocks = 0; frames < 100 && blocks < 5000; ++blocks) {
    const Result<AudioBlock> block = audio->next(std::chrono::milliseconds(50));
    if (!block) continue;
    EXPECT_EQ(block->rate_hz, 48'000.0);
    EXPECT_LT(before, block->first_at + std::chrono::seconds(2));
    before = block->first_at;
    frames += decoder.decode(*block).size();
  }
  ::unsetenv("ALSA_CONFIG_PATH");  // NOLINT(concurrency-mt-unsafe)

  EXPECT_GE(frames, 100U);
}

TEST(AlsaAudio, NamesADeviceThatIsNotThere) {
  TimecodeSettings settings;
  settings.device = "hw:31";
  const std::unique_ptr<AudioSource> audio = make_alsa_audio(settings);

  const Result<AudioBlock> block = audio->next(std::chrono::milliseconds(1));
  const Result<AudioBlock> again = audio->next(std::chrono::milliseconds(1));

  ASSERT_FALSE(block);
  EXPECT_NE(block.error().message.find("device 'hw:31': cannot be opened"), std::string::npos) << block.error().message;
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().message, block.error().message);
}

}  // namespace alsa_audio_test
}  // namespace mocap::timecode
