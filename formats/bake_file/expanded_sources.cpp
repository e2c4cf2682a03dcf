#include "formats/bake_file/expanded_sources.h"

#include <algorithm>
#include <deque>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "formats/bake_file/baked_portals.h"
#include "formats/bake_file/image_source.h"
#include "formats/bake_file/page.h"
#include "formats/bake_file/source_octree.h"

namespace clamor {

namespace {

class Reader {
 public:
  explicit Reader(const BakeFile& file) : file_(file) {
    all_.emitters = file.source_emitters();
    all_.stored_as.resize(file.emitters().size());
    std::iota(all_.stored_as.begin(), all_.stored_as.end(), 0u);
    const std::vector<float> openness = openness_by_set(file.portals(), {});
    is_silent_.resize(file.emitters().size());
    for (const PortalEmitter& one : file.portals().emitters) {
      all_.stored_as.push_back(one.emitter);
      is_silent_.push_back(!(openness[one.set] > 0));
    }
  }

  // The traversal is not recursive, because the depth of trees is limited by the file size only.
  Result<void> read(const PageEntry& top) {
    placed_.push_back({});
    waiting_ = {{top, &placed_.back()}};
    while (!waiting_.empty()) {
      const Waiting next = waiting_.back();
      waiting_.pop_back();
      if (const auto done = read_one(next); !done.ok()) return done;
    }
    return {};
  }

  // Reads nodes in the order of their highest keys, and returns the highest key that may be
  // missing.
  Result<double> read_strongest(const PageEntry& top, std::size_t count) {
    const auto weaker = [](const Waiting& a, const Waiting& b) { return a.bound() < b.bound(); };
    placed_.push_back({});
    waiting_ = {{top, &placed_.back()}};
    double missing = 0;
    while (!waiting_.empty() && waiting_.front().bound() > missing) {
      std::pop_heap(waiting_.begin(), waiting_.end(), weaker);
      const Waiting next = waiting_.back();
      waiting_.pop_back();
      const std::size_t others = waiting_.size();
      if (const auto done = read_one(next); !done.ok()) return done.error();
      for (std::size_t end = others; end < waiting_.size();)
        std::push_heap(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(++end),
                       weaker);
      if (all_.sources.size() > 2 * count) missing = keep_strongest(count, missing);
    }
    if (all_.sources.size() > count) missing = keep_strongest(count, missing);
    if (!waiting_.empty()) missing = std::max(missing, waiting_.front().bound());
    std::erase_if(all_.sources, [&](const Source& source) {
      return missing > 0 && static_cast<double>(octree_key(source)) <= missing;
    });
    return missing;
  }

  ExpandedSources take() {
    const std::vector<Source> images = image_sources(file_.images(), file_.emitters());
    all_.sources.insert(all_.sources.end(), images.begin(), images.end());
    return std::move(all_);
  }

 private:
  struct PlacedTree {
    Placement placement;
    std::vector<std::uint32_t> signals;  // replacement of each signal; empty: none
  };

  struct Waiting {
    PageEntry entry;
    const PlacedTree* tree;

    // Upper bound of the keys of its sources.
    double bound() const {
      return static_cast<double>(entry.highest_key) * tree->placement.power * (1 + 1e-6);
    }
  };

  // Drops all but the `count` highest keys, and returns the highest key that is missing.
  double keep_strongest(std::size_t count, double missing) {
    const auto last = all_.sources.begin() + static_cast<std::ptrdiff_t>(count);
    std::nth_element(
        all_.sources.begin(), last, all_.sources.end(),
        [](const Source& a, const Source& b) { return octree_key(a) > octree_key(b); });
    missing = std::max(missing, static_cast<double>(octree_key(*last)));
    all_.sources.resize(count);
    return missing;
  }

  Result<void> read_one(const Waiting& next) {
    PageLinks links;
    if (const auto done = file_.read_page(next.entry, *reader_, links); !done.ok()) return done;
    const PageColumns& columns = reader_->columns;
    for (std::size_t i = 0; i < columns.count; ++i) {
      Source source = next.tree->placement.place(columns.source(i));
      if (source.emitter >= file_.source_emitters().size())
        return Error(file_.path() +
                     ": an instance plays an emitter that does not exist. Bake again.");
      if (is_silent_[source.emitter]) continue;
      std::uint32_t signal = file_.source_emitters()[columns.emitter[i]].signal;
      if (!next.tree->signals.empty()) signal = next.tree->signals[signal];
      source.emitter = playing(source.emitter, signal);
      all_.sources.push_back(source);
    }
    for (std::size_t k = links.instances.size(); k-- > 0;) {
      const Instance& instance = links.instances[k];
      placed_.push_back(
          {next.tree->placement.then(instance), composed(next.tree->signals, instance.signals)});
      wait_for(file_.trees()[instance.tree], &placed_.back());
    }
    for (std::size_t k = links.children.size(); k-- > 0;) wait_for(links.children[k], next.tree);
    return {};
  }

  // Skips subtrees without sources, which a forged file could reach along exponentially many paths.
  void wait_for(const PageEntry& entry, const PlacedTree* tree) {
    if (entry.sources_below > 0) waiting_.push_back({entry, tree});
  }

  // Applies the map of the inner instance, then that of the outer.
  std::vector<std::uint32_t> composed(const std::vector<std::uint32_t>& outer,
                                      std::uint32_t inner) const {
    if (inner == kSameSignals) return outer;
    std::vector<std::uint32_t> map = file_.signal_maps()[inner];
    if (!outer.empty())
      for (std::uint32_t& signal : map) signal = outer[signal];
    return map;
  }

  // The variant of `emitter` that plays `signal`.
  std::uint32_t playing(std::uint32_t emitter, std::uint32_t signal) {
    if (signal == file_.source_emitters()[emitter].signal) return emitter;
    const auto next = static_cast<std::uint32_t>(all_.emitters.size());
    const auto [known, is_new] = added_.try_emplace({emitter, signal}, next);
    if (is_new) {
      Emitter other = file_.source_emitters()[emitter];
      other.signal = signal;
      all_.emitters.push_back(std::move(other));
      all_.stored_as.push_back(all_.stored_as[emitter]);
    }
    return known->second;
  }

  const BakeFile& file_;
  ExpandedSources all_;
  std::vector<bool> is_silent_;  // by emitter: of the closed state, while all portals are open
  std::deque<PlacedTree> placed_;
  std::vector<Waiting> waiting_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> added_;
  const std::unique_ptr<PageReader> reader_ = std::make_unique<PageReader>();
};

}  // namespace

std::vector<Source> image_sources(std::span<const ImageSource> images,
                                  const std::vector<Emitter>& emitters) {
  std::vector<Source> sources;
  for (const ImageSource& image : images) {
    const Emitter& emitter = emitters[image.emitter];
    Source& source = sources.emplace_back();
    source.emitter = image.emitter;
    set_from_emitter(source, emitter);
    source.is_image = true;
    source.position_m = Vec3f(image.position_m);
    source.normal = Vec3f(image.axis);
    source.original_m = Vec3f(emitter.position_m);
    source.u = 1;
  }
  return sources;
}

Result<ExpandedSources> read_expanded_sources(const BakeFile& file) {
  if (file.source_count() > kMaxExpandedSources)
    return Error(
        file.path() + ": holds " + std::to_string(file.source_count()) +
        " sources with those of instances, too many to be taken all at once (the most are " +
        std::to_string(kMaxExpandedSources) + "). Choose among them with --strategy priority.");
  Reader reader(file);
  if (file.top() != nullptr)
    if (const auto done = reader.read(*file.top()); !done.ok()) return done.error();
  return reader.take();
}

Result<StrongestSources> read_strongest_sources(const BakeFile& file, std::size_t count) {
  Reader reader(file);
  StrongestSources strongest;
  if (file.top() != nullptr) {
    const auto missing = reader.read_strongest(*file.top(), count);
    if (!missing.ok()) return missing.error();
    strongest.missing_key = *missing;
  }
  static_cast<ExpandedSources&>(strongest) = reader.take();
  return strongest;
}

}  // namespace clamor
