#include "timecode/wav_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "support/temporary_folder.h"
#include "wav_bytes.h"

namespace mocap::timecode {
namespace wav_file_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::put;

class Wav : public ::testing::Test {
 protected:
  std::vector<std::int16_t> read(const std::string& bytes, int channel = 1) {
    Result<WavFile> file = WavFile::open(folder.write("x.wav", bytes), channel);
    if (!file) {
      ADD_FAILURE() << file.error().message;
      return {};
    }
    EXPECT_EQ(file->rate_hz(), 44'100.0);
    std::vector<std::int16_t> all;
    for (std::span<const std::int16_t> part = file->read(2); !part.empty(); part = file->read(2)) {
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }
  std::string fault(const std::string& bytes, int channel = 1) {
    const Result<WavFile> file = WavFile::open(folder.write("x.wav", bytes), channel);
    return file ? std::string() : file.error().message;
  }

  support::TemporaryFolder folder;
};

TEST_F(Wav, ReadsOneChannelOf16Bits) {
  std::string data;
  for (const std::int16_t sample : std::vector<std::int16_t>{1, -1, 2, -2, 32767, -32768}) put(data, sample);
  const std::string bytes = testing::wav(1, 2, 44'100, 16, data);

  EXPECT_THAT(read(bytes, 1), ElementsAre(1, 2, 32767));
  EXPECT_THAT(read(bytes, 2), ElementsAre(-1, -2, -32768));
}

TEST_F(Wav, ReadsTheUpperBitsOfLongerSamples) {
  const std::string three("\xFF\x34\x12\x00\x00\x80", 6);
  EXPECT_THAT(read(testing::wav(1, 1, 44'100, 24, three)), ElementsAre(0x1234, -32768));
  std::string four;
  put(four, std::int32_t{0x12345678});
  EXPECT_THAT(read(testing::wav(1, 1, 44'100, 32, four)), ElementsAre(0x1234));
}

TEST_F(Wav, ReadsFloats) {
  std::string data;
  for (const float sample : {0.0F, 1.0F, -1.0F, 7.0F, std::numeric_limits<float>::quiet_NaN()}) put(data, sample);

  EXPECT_THAT(read(testing::wav(3, 1, 44'100, 32, data)), ElementsAre(0, 32767, -32767, 32767, 0));
}

TEST_F(Wav, EndsWhereAFileWasCutOff) {
  std::string data;
  for (const std::int16_t sample : std::vector<std::int16_t>{1, 2, 3, 4}) put(data, sample);
  std::string bytes = testing::wav(1, 1, 44'100, 16, data);
  bytes.resize(bytes.size() - 3);

  EXPECT_THAT(read(bytes), ElementsAre(1, 2));
}

TEST_F(Wav, RefusesWhatItCannotRead) {
  EXPECT_THAT(fault("no WAV"), HasSubstr("is not a WAV file"));
  EXPECT_THAT(fault(testing::wav(1, 1, 44'100, 8, "abcd")), HasSubstr("8 bits"));
  EXPECT_THAT(fault(testing::wav(85, 1, 44'100, 16, "abcd")), HasSubstr("format 85"));
  EXPECT_THAT(fault(testing::wav(1, 0, 44'100, 16, "abcd")), HasSubstr("0 channels"));
  EXPECT_THAT(fault(testing::wav(1, 1, 1, 16, "abcd")), HasSubstr("1 Hz"));
  EXPECT_THAT(fault(testing::wav(1, 1, 44'100, 16, "abcd"), 2), HasSubstr("has 1 channels"));
  EXPECT_EQ(WavFile::open(folder.path() / "none.wav", 1).error().code, ErrorCode::NotFound);
  EXPECT_FALSE(WavFile::open(folder.path(), 1));
}

TEST_F(Wav, SurvivesDamagedHeaders) {
  const std::string good = testing::wav(1, 2, 44'100, 16, std::string(4000, 'x'));
  std::mt19937 random(5);
  for (int round = 0; round < 3000; ++round) {
    std::string bytes = good;
    for (int i = 0; i < 4; ++i) bytes[random() % 64] = static_cast<char>(random());
    bytes.resize(random() % bytes.size());
    Result<WavFile> file = WavFile::open(folder.write("x.wav", bytes), 1);
    for (int reads = 0; file && reads < 10; ++reads) {
      ASSERT_LE(file->read(100).size(), 100U);
    }
  }
}

}  // namespace wav_file_test
}  // namespace mocap::timecode
