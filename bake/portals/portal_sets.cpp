#include "bake/portals/portal_sets.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <numeric>
#include <set>
#include <utility>

#include "formats/bake_file/first_leg.h"

namespace clamor {

namespace {

constexpr std::uint32_t kNoNumber = std::numeric_limits<std::uint32_t>::max();
// The most sets of a probe's tree while it is thinned: as many as a ProbePath can name.
constexpr std::size_t kMaxProvisionalSets = 1 << 12;

// The portals of `set` whose bits are set in `chosen`.
PortalSet subset(const PortalSet& set, unsigned chosen) {
  PortalSet part;
  for (std::size_t i = 0; i < set.size(); ++i)
    if ((chosen >> i & 1) != 0) part.add(set.numbers[i] - 1u);
  return part;
}

}  // namespace

std::uint32_t PortalSetTable::number_of(const PortalSet& set, std::size_t max_sets) {
  if (const auto known = numbers_.find(set); known != numbers_.end()) return known->second;
  if (sets_.size() < max_sets) {
    numbers_[set] = static_cast<std::uint32_t>(sets_.size());
    sets_.push_back(set);
    return numbers_[set];
  }
  // The subset with the lowest number wins among those of the same size.
  std::pair<int, std::uint32_t> best{0, 0};  // minus the size, number
  for (unsigned chosen = 1; chosen + 1 < 1u << set.size(); ++chosen)
    if (const auto known = numbers_.find(subset(set, chosen)); known != numbers_.end())
      best = std::min(best, {-std::popcount(chosen), known->second});
  return best.second;
}

std::vector<std::uint32_t> PortalSetTable::numbers_of(std::span<const PortalSet> sets,
                                                      std::span<const double> powers,
                                                      std::size_t max_sets) {
  std::vector<std::size_t> order(sets.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return powers[a] != powers[b] ? powers[a] > powers[b] : sets[a] < sets[b];
  });
  std::vector<std::uint32_t> numbers(sets.size());
  for (const std::size_t i : order) numbers[i] = number_of(sets[i], max_sets);
  return numbers;
}

std::size_t PortalPairs::HashOfPair::operator()(const Pair& pair) const {
  std::uint64_t mixed = std::bit_cast<std::uint64_t>(pair.set.numbers) * 0x9e3779b97f4a7c15u;
  mixed = (mixed ^ mixed >> 29 ^ pair.emitter) * 0xbf58476d1ce4e5b9u;
  return static_cast<std::size_t>(mixed ^ mixed >> 32);
}

std::uint32_t PortalPairs::number_of(std::uint32_t emitter, const PortalSet& set) {
  if (set.is_empty()) return emitter;
  const auto next = static_cast<std::uint32_t>(emitters_ + pairs_.size());
  const auto [known, is_new] = numbers_.try_emplace(Pair{emitter, set}, next);
  if (is_new) pairs_.push_back({emitter, set});
  return known->second;
}

void PortalPairs::count(std::span<const Source> sources) {
  is_used_.resize(pairs_.size());
  for (const Source& source : sources) {
    if (source.emitter < emitters_) continue;
    const std::size_t pair = source.emitter - emitters_;
    power_of_set_[pairs_[pair].set] += sum_of(source.power);
    is_used_[pair] = 1;
  }
}

void PortalPairs::number(PortalSetTable& table, std::size_t max_sets,
                         std::vector<PortalEmitter>& made) {
  std::vector<PortalSet> sets;
  std::vector<double> powers;
  for (const auto& [set, power] : power_of_set_) {
    sets.push_back(set);
    powers.push_back(power);
  }
  const auto numbers = table.numbers_of(sets, powers, max_sets);
  std::map<PortalSet, std::uint32_t> number_of_set;
  for (std::size_t s = 0; s < sets.size(); ++s) number_of_set[sets[s]] = numbers[s];

  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> finals;  // by emitter and set
  for (std::size_t p = 0; p < is_used_.size(); ++p)
    if (is_used_[p] != 0)
      if (const std::uint32_t set = number_of_set[pairs_[p].set]; set != 0)
        finals[{pairs_[p].emitter, set}];
  for (auto& [pair, number] : finals) {
    number = static_cast<std::uint32_t>(emitters_ + made.size());
    made.push_back({pair.first, pair.second});
  }
  finals_.assign(is_used_.size(), 0);
  for (std::size_t p = 0; p < is_used_.size(); ++p) {
    if (is_used_[p] == 0) continue;
    const std::uint32_t set = number_of_set[pairs_[p].set];
    finals_[p] = set == 0 ? pairs_[p].emitter : finals[{pairs_[p].emitter, set}];
  }
}

void PortalPairs::apply(std::span<Source> sources) const {
  for (Source& source : sources)
    if (source.emitter >= emitters_) source.emitter = finals_[source.emitter - emitters_];
}

ProbePath ProbePortalSets::path_of(std::uint32_t first_leg, const PortalSet& set) {
  return {first_leg, provisional_.number_of(set, kMaxProvisionalSets)};
}

void ProbePortalSets::finish(std::span<Source> sources, PortalSetTable& table) {
  std::vector<double> powers(provisional_.sets().size());
  for (const Source& source : sources) powers[source.path.portal_set] += sum_of(source.power);
  std::vector<PortalSet> kept;
  std::vector<double> kept_powers;
  std::vector<std::uint32_t> place(powers.size(), kNoNumber);
  for (std::uint32_t s = 1; s < powers.size(); ++s) {
    if (!(powers[s] > 0)) continue;
    place[s] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(provisional_.sets()[s]);
    kept_powers.push_back(powers[s]);
  }
  const auto numbers = table.numbers_of(kept, kept_powers);
  for (Source& source : sources) {
    const std::uint32_t at = place[source.path.portal_set];
    source.path.portal_set = at == kNoNumber ? 0 : numbers[at];
  }
  provisional_ = {};
}

}  // namespace clamor
