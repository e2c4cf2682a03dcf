#include "seating.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "dice.h"
#include "stands.h"

namespace clamor::assets {

namespace {

constexpr std::uint64_t kSeed = 16416;

// Blocks of a tier from each side and corner, round the bowl from +X to -Z.
constexpr std::array<std::size_t, 8> kBlocksOfStand = {4, 2, 6, 2, 4, 2, 6, 2};

std::size_t stand_of(std::size_t place) {
  std::size_t stand = 0;
  for (std::size_t end = kBlocksOfStand[0]; place >= end; end += kBlocksOfStand[++stand]) {
  }
  return stand;
}

Vec3 turned(const Vec3& v, double yaw_rad) {
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  return {c * v.x + s * v.z, v.y, c * v.z - s * v.x};
}

double yaw_of(const Vec3& outward) { return std::atan2(outward.x, outward.z); }

// The seats of a block, seen from its first one.
struct SeatsOfBlock {
  Vec3 corner_m{};
  double yaw_rad = 0;
  std::vector<Vec3> feet_m;
  std::vector<double> yaws_rad;
};

std::vector<SeatsOfBlock> blocks_of(const Bowl& bowl) {
  std::vector<SeatsOfBlock> blocks;
  for (const Seat& seat : seats_of(bowl)) {
    const auto index = static_cast<std::size_t>(seat.block);
    if (index >= blocks.size()) blocks.resize(index + 1);
    SeatsOfBlock& block = blocks[index];
    if (block.feet_m.empty()) {
      block.corner_m = seat.feet_m;
      block.yaw_rad = yaw_of(seat.outward);
    }
    block.feet_m.push_back(turned(seat.feet_m - block.corner_m, -block.yaw_rad));
    block.yaws_rad.push_back(yaw_of(turned(seat.outward, -block.yaw_rad)));
  }
  return blocks;
}

bool same_seats(const SeatsOfBlock& a, const SeatsOfBlock& b) {
  if (a.feet_m.size() != b.feet_m.size()) return false;
  for (std::size_t i = 0; i < a.feet_m.size(); ++i)
    if (length(a.feet_m[i] - b.feet_m[i]) > 1e-6) return false;
  return true;
}

std::size_t draw_sound(std::span<const CrowdSound> sounds, bool in_unison, Dice& dice) {
  double total = 0;
  for (const CrowdSound& sound : sounds)
    if (sound.in_unison || !in_unison) total += sound.share;
  double left = dice.unit() * total;
  std::size_t last = 0;
  for (std::size_t i = 0; i < sounds.size(); ++i) {
    if (!sounds[i].in_unison && in_unison) continue;
    last = i;
    left -= sounds[i].share;
    if (left < 0) break;
  }
  return last;
}

// Sounds that fans of one kind of block may take up instead of each other: alike in level and beam.
// The first of them is what the kind's fans sing.
using Songbook = std::vector<std::size_t>;

Songbook songs_of(std::span<const CrowdSound> sounds) {
  Songbook songs;
  for (std::size_t i = 0; i < sounds.size(); ++i) {
    const CrowdSound& first = sounds[songs.empty() ? i : songs[0]];
    if (sounds[i].in_unison && sounds[i].gain_db == first.gain_db &&
        sounds[i].directivity == first.directivity)
      songs.push_back(i);
  }
  return songs;
}

// Probability that each seat is taken, lower rows first.
std::vector<double> ranks_of(const SeatsOfBlock& block, Dice& dice) {
  std::vector<double> ranks;
  for (std::size_t i = 0; i < block.feet_m.size(); ++i) {
    const double along = std::abs(std::cos(block.yaw_rad + block.yaws_rad[i]));
    const double up_m = block.corner_m.y + block.feet_m[i].y;
    const double view = 0.6 * along + 0.8 * (1 - up_m / 16);
    ranks.push_back(dice.unit() - 0.35 * view);
  }
  return ranks;
}

// The seats of each kind that are taken, so that all blocks together have `fan_count` fans.
std::vector<std::vector<std::size_t>> taken_seats(const std::vector<SeatsOfBlock>& models,
                                                  const std::vector<std::size_t>& repeats,
                                                  std::size_t fan_count) {
  Dice dice(kSeed);
  struct Offer {
    double rank;
    std::size_t kind, seat;
  };
  std::vector<Offer> offers;
  for (std::size_t kind = 0; kind < models.size(); ++kind) {
    const std::vector<double> ranks = ranks_of(models[kind], dice);
    for (std::size_t i = 0; i < ranks.size(); ++i) offers.push_back({ranks[i], kind, i});
  }
  std::stable_sort(offers.begin(), offers.end(),
                   [](const Offer& a, const Offer& b) { return a.rank < b.rank; });
  std::vector<std::vector<std::size_t>> taken(models.size());
  // No fewer may be left than a seat of some kind would fill.
  const std::size_t fewest = *std::min_element(repeats.begin(), repeats.end());
  std::size_t left = fan_count;
  for (const Offer& offer : offers) {
    const std::size_t fans = repeats[offer.kind];
    if (fans != left && fans + fewest > left) continue;
    taken[offer.kind].push_back(offer.seat);
    left -= fans;
  }
  for (auto& seats : taken) std::sort(seats.begin(), seats.end());
  return taken;
}

// Half of the fans join in what the block sings, the rest do as they like.
BlockKind fill(const SeatsOfBlock& block, const std::vector<std::size_t>& taken,
               std::span<const CrowdSound> sounds, const Songbook& songs, const StartTimes& starts,
               double mouth_m, Dice& dice) {
  std::map<std::size_t, FanGroup> by_sound;
  for (const std::size_t i : taken) {
    const bool joins = dice.unit() < 0.5;
    std::size_t sound = draw_sound(sounds, joins, dice);
    if (joins && std::find(songs.begin(), songs.end(), sound) != songs.end()) sound = songs[0];
    const double scale = 1 + 0.08 * dice.between(-1, 1);
    const double yaw = block.yaws_rad[i] + dice.between(-0.25, 0.25);
    const double aside_m = dice.between(-0.06, 0.06), ahead_m = dice.between(-0.06, 0.06);
    const double delay_s = dice.between(0, joins ? starts.in_unison_s : starts.alone_s);
    const Vec3 sway(aside_m, mouth_m * scale, ahead_m);
    by_sound[sound].fans.push_back({block.feet_m[i] + sway, yaw, scale, delay_s});
  }
  BlockKind kind;
  kind.seats = taken.size();
  for (auto& [sound, group] : by_sound) {
    group.sound = sound;
    kind.groups.push_back(std::move(group));
  }
  return kind;
}

// One song leads, drawn by its share; the others change places behind it.
std::vector<std::size_t> draw_songs(std::span<const CrowdSound> sounds, const Songbook& songs,
                                    Dice& dice) {
  std::vector<std::size_t> map(sounds.size());
  std::iota(map.begin(), map.end(), std::size_t{0});
  Songbook left = songs;
  for (const std::size_t song : songs) {
    double total = 0;
    for (const std::size_t one : left) total += sounds[one].share;
    double rest = dice.unit() * total;
    std::size_t pick = 0;
    while (pick + 1 < left.size() && (rest -= sounds[left[pick]].share) >= 0) ++pick;
    map[song] = left[pick];
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(pick));
  }
  return map;
}

// Takes of one kind that no songbook holds change places at random.
void shuffle_takes(std::span<const CrowdSound> sounds, const Songbook& songs, Dice& dice,
                   std::vector<std::size_t>& map) {
  for (std::size_t first = 0, end; first < sounds.size(); first = end) {
    for (end = first + 1; end < sounds.size() && sounds[end].kind == sounds[first].kind; ++end) {
    }
    if (std::find(songs.begin(), songs.end(), first) != songs.end()) continue;
    for (std::size_t left = end - first; left > 1; --left) {
      const auto pick = static_cast<std::size_t>(dice.unit() * static_cast<double>(left));
      std::swap(map[first + pick], map[first + left - 1]);
    }
  }
}

}  // namespace

Seating make_seating(const Bowl& bowl, std::span<const CrowdSound> sounds, const StartTimes& starts,
                     std::size_t fan_count, double mouth_m) {
  const std::vector<SeatsOfBlock> all = blocks_of(bowl);
  std::vector<SeatsOfBlock> models;
  std::vector<std::size_t> repeats, kinds;
  for (const SeatsOfBlock& block : all) {
    const auto known = std::find_if(models.begin(), models.end(), [&](const SeatsOfBlock& model) {
      return same_seats(model, block);
    });
    const auto kind = static_cast<std::size_t>(known - models.begin());
    if (known == models.end()) {
      models.push_back(block);
      repeats.push_back(0);
    }
    ++repeats[kind];
    kinds.push_back(kind);
  }

  Seating seating;
  const auto taken = taken_seats(models, repeats, fan_count);
  const Songbook songs = songs_of(sounds);
  Dice dice(kSeed + 1);
  for (std::size_t kind = 0; kind < models.size(); ++kind)
    seating.kinds.push_back(fill(models[kind], taken[kind], sounds, songs, starts, mouth_m, dice));
  const std::size_t in_tier = all.size() / 2;
  for (std::size_t b = 0; b < all.size(); ++b) {
    const std::size_t place = b % in_tier;
    Block block;
    block.name = (b < in_tier ? "lower " : "upper ") + std::to_string(place + 1);
    block.kind = kinds[b];
    block.stand = stand_of(place);
    block.corner_m = all[b].corner_m;
    block.yaw_rad = all[b].yaw_rad;
    block.delay_s = dice.between(0, starts.of_block_s);
    block.sounds = draw_songs(sounds, songs, dice);
    shuffle_takes(sounds, songs, dice, block.sounds);
    seating.blocks.push_back(std::move(block));
  }
  return seating;
}

}  // namespace clamor::assets
