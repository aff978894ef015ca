#include "scene/program.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

#include "base/expects.h"

namespace mocap::scene {
namespace {

constexpr double kFade_s = 0.6;
constexpr double kDefaultScene_s = 5.0;
constexpr double kMaxScene_s = 86400.0;

constexpr std::array<std::pair<std::string_view, Act>, 8> kActs{{{"tpose", Act::TPose},
                                                                 {"apose", Act::APose},
                                                                 {"walk", Act::Walk},
                                                                 {"wave", Act::Wave},
                                                                 {"jump", Act::Jump},
                                                                 {"spin", Act::Spin},
                                                                 {"crouch", Act::Crouch},
                                                                 {"hands", Act::Hands}}};

Error bad_word(std::string_view word) {
  return {ErrorCode::InvalidArgument,
          "motion: '" + std::string(word) +
              "' is not an act; expected tpose, apose, walk, wave, jump, spin, crouch or hands with "
              "seconds from 1 to 86400, as in tpose:3,walk:20,wave"};
}

Result<Scene> parse_scene(std::string_view word) {
  const std::size_t colon = word.find(':');
  const auto* named = std::ranges::find(kActs, word.substr(0, colon), &std::pair<std::string_view, Act>::first);
  if (named == kActs.end()) return bad_word(word);
  Scene scene{named->second, kDefaultScene_s};
  if (colon == std::string_view::npos) return scene;
  const std::string_view digits = word.substr(colon + 1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), scene.duration_s);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  if (!whole || !(scene.duration_s >= 1.0 && scene.duration_s <= kMaxScene_s)) return bad_word(word);
  return scene;
}

// Smooth step from 0 to 1 over a fade, and its integral from the start of the fade.
double rise(double t_s) {
  const double u = std::clamp(t_s / kFade_s, 0.0, 1.0);
  return u * u * (3.0 - 2.0 * u);
}
double rise_integral_s(double t_s) {
  if (t_s <= 0.0) return 0.0;
  const double u = std::min(t_s / kFade_s, 1.0);
  return kFade_s * u * u * u * (1.0 - 0.5 * u) + std::max(0.0, t_s - kFade_s);
}

}  // namespace

Result<Program> parse_program(std::string_view text) {
  Program program;
  while (true) {
    const std::size_t comma = text.find(',');
    const auto scene = parse_scene(text.substr(0, comma));
    if (!scene) return scene.error();
    program.scenes.push_back(*scene);
    if (comma == std::string_view::npos) return program;
    text.remove_prefix(comma + 1);
  }
}

ActMix mix_at(const Program& program, double t_s) {
  MOCAP_EXPECTS(!program.scenes.empty());
  t_s = std::max(t_s, 0.0);
  ActMix mix;
  double begin_s = 0.0;
  for (std::size_t i = 0; i < program.scenes.size(); ++i) {
    const bool last = i + 1 == program.scenes.size();
    const double length_s = program.scenes[i].duration_s;
    const double since_s = t_s - begin_s;
    const double since_end_s = last ? -1.0 : since_s - length_s;
    // The weight of a scene rises at its start and falls while the next scene rises. The first scene starts at 1.
    const double up = i == 0 ? 1.0 : rise(since_s);
    const double up_integral_s = i == 0 ? since_s : rise_integral_s(since_s);
    ActShare share{program.scenes[i].act, up - rise(since_end_s), up_integral_s - rise_integral_s(since_end_s), 0.0};
    share.whole_s = last ? std::numeric_limits<double>::infinity() : length_s + (i == 0 ? 0.5 * kFade_s : 0.0);
    if (share.act == Act::Walk) mix.walked_before_s += share.spent_s;
    if (share.share > 0.0) (mix.first.share > 0.0 ? mix.second : mix.first) = share;
    if (last || since_end_s <= 0.0) break;
    begin_s += length_s;
  }
  return mix;
}

}  // namespace mocap::scene
