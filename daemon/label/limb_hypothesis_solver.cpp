#include "label/limb_hypothesis_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mocap::label {
namespace {

using Reading = TieReader::Reading;

// In half squared sigmas: what a further name is worth, what a track's own name counts, how unlikely it is that a track
// of one or two sets is a marker, that the body followed wrong names; and what a reading must be better by.
constexpr double kWorthAName = 12.0;
constexpr double kOwn = 3.0;
constexpr double kTooYoung = 5.0;
constexpr double kMisread = 6.0;
constexpr double kClearMargin = 5.0;
// What readings that say otherwise must be worse by: one fit may stop short of where another ends. The second where
// they give a track to another name, the third where that is of the same bone: two markers of one bone are told from
// each other by how it is turned about itself, of which the body knows least.
constexpr double kUndecided = 6.5;
constexpr double kRival = 7.5;
constexpr double kTwin = 10.0;
// What costs so much more than the best is not better for another turn of a bone.
constexpr double kHopeless = 40.0;
// Costs tell which reading is better more surely than they tell how much: one that is worse by so much has the e-th
// part of the odds.
constexpr double kTellsOdds = 2.0;
constexpr std::size_t kChallenges = 3;      // of each name that a reading would give, twice
constexpr std::size_t kMostExchanged = 48;  // readings, to better the best
constexpr std::size_t kMostReadings =
    1 + TieReader::kMostReadings + kMostExchanged + 2 * kChallenges * TieReader::kMostNames;

}  // namespace

LimbReader::LimbReader(const MarkerSet& set, const pose::FollowSettings& follow) : body_(set, follow) {
  for (const MarkerOnBone& marker : set.markers) bone_of_.push_back(marker.bone);
  places_.reserve(TieReader::kMostPlaces);
  others_.reserve(set.markers.size());
  tried_.reserve(set.markers.size());
  misread_.resize(set.skeleton.bones.size());
  loose_.resize(set.skeleton.bones.size());
  best_pose_.reserve(set.skeleton.bones.size());
  twins_.reserve(TieReader::kMostNames);
  readings_.reserve(kMostReadings);
}

void LimbReader::clear() {
  ties_.clear();
  places_.clear();
  for (auto& hints : hint_) hints.fill(0.0);
  now_.place_of.fill(kNowhere);
  likeliest_ = now_;
  stop();
  found_ = false;
}

bool LimbReader::add_name(std::size_t marker) { return ties_.add_name(marker); }

bool LimbReader::add_place(const Place& place) {
  if (!ties_.add_place(place.at)) return false;
  places_.push_back(place);
  return true;
}

void LimbReader::allow(std::size_t name, std::size_t place, double cost, double hint) {
  hint_[name][place] = hint;
  ties_.allow(name, place, cost + (places_[place].young ? kTooYoung : 0.0) - kOwn * hint);
}

void LimbReader::begin(const identify::MarkerTies& ties, const pose::BodyFollower& body,
                       std::span<const kinematics::Observation> others, std::span<const char> misread) {
  body_ = body;
  others_.assign(others.begin(), others.end());
  misread_.assign(misread.begin(), misread.end());
  found_ = false;
  judged_ = 0;
  next_twin_ = 0;
  readings_.clear();
  readings_.push_back(now_);
  propose(ties_.read(ties, kWorthAName));
  stage_ = readings_.size() > 1 ? Stage::First : Stage::Done;
}

int LimbReader::advance(const identify::MarkerTies& ties, int most) {
  int done = 0;
  while (busy()) {
    if (judged_ < readings_.size()) {
      if (done == most) break;
      judge(judged_++);
      ++done;
    } else if (stage_ == Stage::Twins && next_twin_ < readings_.size()) {
      if (done == most) break;
      if (judge_anew(next_twin_++)) ++done;
    } else if (!propose_more(ties)) {
      stage_ = Stage::Done;
      decide();
    }
  }
  return done;
}

const Reading& LimbReader::best_judged() const {
  const auto end = readings_.begin() + static_cast<std::ptrdiff_t>(judged_);
  return *std::min_element(readings_.begin(), end, [](const Reading& a, const Reading& b) { return a.cost < b.cost; });
}

// Whether there is more to be judged, when all is that was proposed, or to be judged anew.
bool LimbReader::propose_more(const identify::MarkerTies& ties) {
  const std::size_t before = readings_.size();
  if (stage_ == Stage::First) {
    if (!(best_judged().cost + kClearMargin < readings_[0].cost)) return false;
    stage_ = Stage::Exchange;
    best_ = readings_[0];
    most_exchanged_ = before + kMostExchanged;
  }
  if (stage_ == Stage::Exchange) {
    if (best_judged().cost < best_.cost) {
      best_ = best_judged();
      exchange_neighbours(ties);
      if (readings_.size() > before) return true;
    }
    stage_ = Stage::Challenge;
    best_ = best_judged();
    next_name_ = 0;
  }
  if (stage_ == Stage::Twins) return false;
  if (!challenge_next(ties)) stage_ = Stage::Twins;
  return true;
}

bool LimbReader::propose(const Reading& reading) {
  const auto names = static_cast<std::ptrdiff_t>(ties_.names());
  const bool known = std::any_of(readings_.begin(), readings_.end(), [&](const Reading& there) {
    return std::equal(there.place_of.begin(), there.place_of.begin() + names, reading.place_of.begin());
  });
  if (!known) readings_.push_back(reading);
  return !known;
}

void LimbReader::propose(std::span<const Reading> found) {
  for (const Reading& one : found) (void)propose(one);
}

// Many readings of a limb cost the same by distances, and a short list may lack the one that the pose likes best: from
// the best that is known, each new name is moved to, or exchanged with, each neighbour that is not surely named.
void LimbReader::exchange_neighbours(const identify::MarkerTies& ties) {
  for (std::size_t a = 0; a < names(); ++a) {
    if (best_.place_of[a] < 0 || now_.place_of[a] >= 0) continue;
    for (const identify::Tie& tie : ties.of(marker(a))) {
      std::size_t b = 0;
      while (b < names() && marker(b) != static_cast<std::size_t>(tie.other)) ++b;
      if (b == names() || now_.place_of[b] >= 0) continue;
      Reading other = best_;
      std::swap(other.place_of[a], other.place_of[b]);
      if (readings_.size() < most_exchanged_) (void)propose(other);
    }
  }
}

// The cheapest readings by distances may all agree on a name because they differ in others: what speaks against each
// new name is looked for on purpose.
bool LimbReader::challenge_next(const identify::MarkerTies& ties) {
  const std::size_t before = readings_.size();
  while (next_name_ < names() && readings_.size() == before) {
    const std::size_t name = next_name_++;
    const int place = best_.place_of[name];
    if (place < 0 || place == now_.place_of[name]) continue;
    const bool doubted = std::any_of(readings_.begin(), readings_.end(),
                                     [&](const Reading& other) { return doubts(other, best_, name); });
    if (!doubted) challenge(name, ties);
  }
  return readings_.size() > before;
}

void LimbReader::challenge(std::size_t name, const identify::MarkerTies& ties) {
  propose(ties_.read_otherwise(ties, kWorthAName, name, best_, kChallenges));
  Reading alone;
  alone.place_of.fill(kNowhere);
  alone.place_of[name] = best_.place_of[name];
  propose(ties_.read_otherwise(ties, kWorthAName, name, alone, kChallenges));
}

// The markers as a reading has them, and what it costs beside what the body says to it: the worth of the names that it
// leaves out, first of all.
double LimbReader::put_together(const Reading& reading) {
  tried_.assign(others_.begin(), others_.end());
  std::copy(misread_.begin(), misread_.end(), loose_.begin());
  bool contradicts = false;
  double cost = 0.0;
  for (std::size_t n = 0; n < names(); ++n) {
    const int at = reading.place_of[n];
    if (now_.place_of[n] >= 0 && at != now_.place_of[n]) {
      contradicts = true;
      loose_[static_cast<std::size_t>(bone_of(n))] = 1;
    }
    if (at < 0) {
      cost += kWorthAName;
      continue;
    }
    const Place& place = places_[static_cast<std::size_t>(at)];
    tried_.push_back({static_cast<int>(marker(n)), place.at, place.sigma_m});
    cost += (place.young ? kTooYoung : 0.0) - kOwn * hint_[n][static_cast<std::size_t>(at)];
  }
  if (contradicts) cost += kMisread;
  body_.misread(loose_);
  return cost;
}

void LimbReader::judge(std::size_t reading) {
  const double cost = put_together(readings_[reading]);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < reading; ++i) least = std::min(least, readings_[i].cost);
  readings_[reading].cost = cost + body_.explain(tried_, least + kTwin - cost).cost;
  if (readings_[reading].cost < least) best_pose_.assign(body_.pose().locals().begin(), body_.pose().locals().end());
}

// From the pose at hand a fit may not find how a bone is turned about itself. A reading that has one marker of a bone
// where the best one has another is judged from where that one led to, too, with the bone swung from marker to marker.
// False where it is no such reading.
bool LimbReader::judge_anew(std::size_t reading) {
  Reading& one = readings_[reading];
  const Reading& best = best_judged();
  if (one.cost > best.cost + kHopeless) return false;
  find_twins(one, best);
  if (twins_.empty()) return false;
  const double cost = put_together(one);
  const double anew = cost + body_.explain_near(best_pose_, twins_, tried_, one.cost - cost).cost;
  if (anew < best.cost) best_pose_.assign(body_.pose().locals().begin(), body_.pose().locals().end());
  one.cost = std::min(one.cost, anew);
  return true;
}

void LimbReader::find_twins(const Reading& reading, const Reading& best) {
  twins_.clear();
  for (std::size_t n = 0; n < names(); ++n) {
    const int place = reading.place_of[n];
    if (place < 0 || place == best.place_of[n] || bone_of(n) == 0) continue;
    const std::size_t other = bearer(best, place);
    if (other != names() && bone_of(other) == bone_of(n))
      twins_.push_back({static_cast<int>(marker(n)), static_cast<int>(marker(other))});
  }
}

// Whether another reading is nearly as good as the best, and has a name that the best gives, or its place, otherwise.
bool LimbReader::doubts(const Reading& other, const Reading& best, std::size_t name) const {
  const int place = best.place_of[name];
  if (place < 0 || other.place_of[name] == place) return false;
  return other.cost <= best.cost + margin(name, bearer(other, place));
}

// What a reading that gives a name's place to another, or to none, must be worse by.
double LimbReader::margin(std::size_t name, std::size_t instead) const {
  if (instead == names()) return kUndecided;
  return bone_of(instead) == bone_of(name) ? kTwin : kRival;
}

// The name that a reading gives to a place; past all names: none.
std::size_t LimbReader::bearer(const Reading& reading, int place) const {
  const auto end = reading.place_of.begin() + static_cast<std::ptrdiff_t>(names());
  return static_cast<std::size_t>(std::find(reading.place_of.begin(), end, place) - reading.place_of.begin());
}

void LimbReader::decide() {
  best_ = best_judged();
  found_ = best_.cost + kClearMargin < readings_[0].cost;
  likeliest_ = best_;
  for (const Reading& other : readings_) {
    for (std::size_t n = 0; n < names(); ++n) {
      if (doubts(other, likeliest_, n)) best_.place_of[n] = kNowhere;
    }
  }
}

LimbReader::Shares LimbReader::shares_at(int place) const {
  Shares shares{};
  const std::size_t likeliest = bearer(likeliest_, place);
  if (likeliest == names()) return shares;
  double sum = 0.0;
  for (const Reading& one : readings_) {
    const std::size_t name = bearer(one, place);
    if (one.cost > likeliest_.cost + margin(likeliest, name)) continue;
    if (name == names()) return {};
    const double share = std::exp((likeliest_.cost - one.cost) / kTellsOdds);
    shares[name] += share;
    sum += share;
  }
  for (double& share : shares) share /= sum;
  return shares;
}

}  // namespace mocap::label
