// octree_pool.h: the sources of a heap-ordered octree (source_octree.h) whose pages may be missing.
//
// A look-up walks down from the top and leaves out a node where
//
//   highest key x most that a power of 1 can weigh at the distance to its bounds < threshold,
//
// boosted as its latest source is (late_boost.h), or where its emission cone points away
// (priority_bound.h): nothing in it or below can reach the threshold. Of a page that is missing its
// parent's page knows the bound, and so it is asked for in that order.
//
// A copy of a tree (instance.h) is walked in the tree's own space: the place is moved instead of
// the sources, and the threshold divided by the copy's gain. Only what is found is put where the
// level has it. And it is walked only if a source other than its representative could reach the
// threshold; else that one is looked at, and nothing else (instance_representatives.h), so that a
// billion sources cost what their few thousand copies do that are within reach.
//
// octree_traversal.cpp has the walk, octree_plan.cpp what saves most keyframes one, and
// planned_query.cpp how a plan is gone through.
//
// Signals that are over, or have not begun, raise no bound: only what they play, smoothed, within
// the longest way to the listener counts.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <span>
#include <vector>

#include "formats/bake_file/bake_file.h"
#include "formats/bake_file/page_links.h"
#include "runtime/propagation/signal_maps.h"
#include "runtime/query/culled_node_cache.h"
#include "runtime/query/instance_representatives.h"
#include "runtime/query/page_shortlists.h"
#include "runtime/query/priority_bound.h"
#include "runtime/query/source_pool.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

// Weights that no copy's sources exceed, whatever signals it plays instead: of the ceilings.
SignalWeights max_over_instances(const SignalWeights& weights,
                                 std::span<const std::vector<std::uint32_t>> signal_maps);

// Pages as a loader wants them, from a file. Everything must outlive what comes out.
PageLoader::Fetch page_fetch(const BakeFile& file, const RadiationModel& field,
                             const SignalWeights& ceilings);

// Parts of the query that can be turned off, to measure what each of them buys. All but
// `late_boost` leave the sample as it is.
struct QuerySwitches {
  bool plans = true;            // node lists that hold for several keyframes
  bool turns = true;            // a third of such a list per keyframe
  bool shortlists = true;       // source lists that hold for several keyframes
  bool culled_nodes = true;     // CulledNodeCache
  bool representatives = true;  // InstanceRepresentatives
  bool occlusion = true;        // OcclusionUpperBounds
  bool late_boost = true;
};

class OctreePool final : public SourcePool {
 public:
  // `trees` and `signal_maps` as in BakeFile; the last tree is the level's. `ceilings` are those of
  // max_over_instances(). All must outlive the pool. Fetches the first pages with sources of each
  // tree, for good.
  OctreePool(const RadiationModel& field, const SignalWeights& ceilings,
             std::span<const PageEntry> trees,
             std::span<const std::vector<std::uint32_t>> signal_maps, PageLoader& loader);

  // Before the first look.
  void ablate(const QuerySwitches& on) { on_ = on; }

  bool refresh() override;
  // Bounds nodes by the loudest that any signal was while what is heard now was under way.
  void begin(const Vec3& place, double time_s) override;
  void set_occlusion_bounds(const OcclusionUpperBounds* hidden, bool may_lag) override;
  void set_late_boost(float strength) override {
    if (!on_.late_boost) strength = 0;
    if (strength != strength_) {
      quiet_.clear();
      forget_plans();
    }
    strength_ = strength;
  }
  bool look(const Vec3& place, double threshold, std::size_t most,
            std::vector<FoundSource>& found) override;
  double highest(const Vec3& place) override;
  double unseen_key(const FoundSource& found, double tau) override;
  void ask(const Vec3& soon, double tau) override;
  bool missed() const override { return !missed_.empty(); }
  bool complete() override;
  std::uint64_t size() const override { return trees_.empty() ? 0 : trees_.back().sources_below; }

  // By all looks so far: pages (of a plan, those that had a source loud enough or whose shortlist
  // was made anew), pages that a plan for further looks was made of, sources in them and in their
  // shortlists that were not left out with their neighbours, and far copies that were a source
  // each.
  std::uint64_t nodes_visited() const { return visited_; }
  std::uint64_t nodes_planned() const { return planned_; }
  std::uint64_t sources_tested() const { return looked_at_; }
  std::uint64_t representatives_found() const { return copies_heard_; }

 private:
  static constexpr std::uint32_t kNoCopy = 0xffffffff;  // found without walking one
  // Nodes and copies in the walks of a keyframe. A billion sources and 20 000 voices take a fifth
  // of them; a forged file, in which copies double again and again, would take any number.
  static constexpr std::uint64_t kMostSteps = 1 << 20;
  // Sources of copies in a look-up without a limit on what is found, as a render's are: with
  // what is made of them, they take half a kilobyte each. Those beyond are passed over like those
  // beyond the steps.
  static constexpr std::size_t kMaxPlaced = 1 << 21;
  // What turning and moving a copy's sources may round; and how far off they are of that, for each
  // metre that the listener is from the origin.
  static constexpr double kTurned = 1e-5, kOffPerM = 0x1p-23;
  // Pages whose lists are fetched from memory before they are passed.
  static constexpr std::size_t kMostMet = 64;
  // Each part of a plan is asked in every so many keyframes. Of ten million sources in Sponza a
  // prototype's keyframe took 1.53, 1.35, 1.34 and 1.31 ms besides rays, in 1, 2, 3 and 4.
  static constexpr std::uint32_t kTurns = 3;
  static_assert(kTurns - 1 <= PageLoader::kMostAhead && kTurns <= OcclusionUpperBounds::kPhases);

  // Where sources are found: the level's octree, or a copy of one.
  struct Copy {
    const PageEntry* tree = nullptr;  // whose cube the octants divide
    Placement placement;
    Vec3 place{};             // of the listener, in the tree's space
    double to_threshold = 1;  // there, of a threshold here
    std::uint32_t map = SignalMaps::kNone;
    bool moved = false;  // not simply the level
    double off_m = 0;    // as MetPage's
  };

  // A node to visit. Where the representative of its copy is in it or below, that has
  // `representative_key`.
  struct Step {
    const PageEntry* entry = nullptr;
    std::uint32_t copy = 0;
    std::uint64_t first = 0;  // number of its first source
    double representative_key = 0;
    double most = 0;  // that a priority in it or below can be
  };

  // A page of which some sources may matter.
  struct Met {
    Step step;
    const Source* sources = nullptr;  // of the page
    std::size_t list = 0;
    double least = 0;        // in its tree
    bool leads = false;      // its first source is the representative of its copy
    std::uint32_t part = 0;  // of the plan
  };

  // The one source of a copy that may matter.
  struct FarCopy {
    const InstanceRepresentative* lead = nullptr;
    const Copy* outer = nullptr;
    const ResidentInstance* copy = nullptr;
    std::uint32_t signal = 0;
    std::uint64_t first = 0;        // number of its first source
    double representative_key = 0;  // in its tree
  };

  // Nodes with sources that may matter wherever the listener walks in a while, in the order of a
  // walk, so that a keyframe need not walk; and the walk that looks for them, part by part.
  struct Plan {
    struct Node {
      Step step;
      double widest = 0;                   // as step.most, wherever the plan holds
      std::uint64_t offset = 0;            // of its page in the file
      const ResidentPage* page = nullptr;  // null: not here
      const Source* sources = nullptr;     // its, if it is
      PageLoader::Place* kept = nullptr;
      std::size_t list = 0;
    };
    // A node whose page is not here.
    struct Missing {
      const PageEntry* entry = nullptr;
      std::uint64_t first = 0;
      double widest = 0;
    };
    // Where, when and above which threshold it need not be asked what the list of a node has:
    // small, and apart from all else, since every keyframe goes through all of these.
    struct Answer {
      Answer() = default;
      Answer(const ValidityRegion& held, const Vec3& from, bool is_empty);

      double until_s = 0;
      Vec3f middle_m{};   // of a ball, seen from the middle of the plan,
      float give_m = -1;  // and its radius; below 0: nowhere
      float threshold = 0;
      bool empty = true;     // as far as is known
      bool by_plan = false;  // known wherever the plan holds, and nowhere else

      // In all of a scope, which lies there.
      bool holds(const Scope& scope, const Vec3f& place_m) const {
        const Vec3f way_m = place_m - middle_m;
        const float left_m = give_m - static_cast<float>(scope.give_m);
        return left_m >= 0 && glm::dot(way_m, way_m) <= left_m * left_m &&
               scope.threshold >= static_cast<double>(threshold) && scope.until_s <= until_s;
      }
    };
    // A source that may matter somewhere in a scope: the most that its priority is at any time and
    // now, as if nothing stood in the way, and what share of it is known to be heard.
    struct Heard {
      const Source* source = nullptr;
      std::uint64_t number = 0;
      std::uint32_t signal = 0, copy = 0;
      float boost = 1, ceiling = 0, loud = 0, known = 1;
    };
    // What was found of nodes side by side, for this keyframe and the next ones: of those whose
    // first sources have numbers of one block, whatever plan they are in.
    struct Part {
      static std::uint64_t block_of(std::uint64_t first) { return first >> 14; }

      std::uint64_t block = 0;
      std::uint32_t first = 0, last = 0;  // nodes: the first, and after the last
      std::uint32_t keyframe = 0;         // when it was asked
      Scope scope;
      std::vector<Heard> heard;
    };
    Vec3 place{};
    double give_m = -1;  // how far from there it holds; below 0: nowhere
    double threshold = 0, until_s = 0;
    std::uint32_t lists = 0;  // which of all ways to number them
    std::vector<Node> nodes;
    std::vector<Answer> asked;  // of each node
    std::vector<Missing> missing;
    std::vector<Copy> copies;
    std::vector<Step> steps;  // to be gone yet; `most` is the widest
    std::vector<Part> parts;  // of a whole plan

    void clear() {
      give_m = -1;
      parts.clear();
      nodes.clear();
      asked.clear();
      missing.clear();
      copies.clear();
      steps.clear();
    }
    void take_over(Plan& last);
    void make_parts();
    template <class IsAsBefore>
    void take_parts(std::vector<Part>& before, const IsAsBefore& is_as_before);
    void forget_answers() { asked.assign(nodes.size(), {}); }
    bool holds(const Vec3& at, double least, double time_s, double margin_m = 0) const {
      return length(at - place) + margin_m <= give_m && least >= threshold && time_s <= until_s;
    }
  };

  // Of a plan, by where they are in it.
  struct PlannedNode {
    std::uint32_t node = 0, part = 0;
  };

  // Nodes of the last plan, for the next one, which comes by most of them in the same order: what
  // is known of them need not be looked for again.
  class LastNodes {
   public:
    LastNodes() = default;
    explicit LastNodes(std::span<const Plan::Node> nodes) : nodes_(nodes) {}
    // The one with that first source and page, by ascending numbers; null if it is not among them,
    // or not here.
    const Plan::Node* find(std::uint64_t first, std::uint64_t offset);
    // From memory, what is below those that come next.
    void prefetch() const;

   private:
    std::span<const Plan::Node> nodes_;
  };

  void bound_signals(const Vec3& place, double time_s);
  void load_first_pages(const PageEntry& top);
  void update_representatives();
  void look_ahead(const Vec3& soon, double tau);
  double bound(const PageEntry& entry, const Copy& copy, double key, double give_m = 0) const {
    return key * priority_bound_.per_key(entry, copy.place, copy.placement.scale, give_m) *
           (copy.moved ? 1 : most_boost(entry));
  }
  double most_boost(const PageEntry& entry) const {
    return 1 + static_cast<double>(strength_ * field_.late_boost().at(entry.max_delay_s));
  }
  // Calls visit(step, page) for all nodes that matter, with what page_of(entry, urgency) gives,
  // until it returns false; goes no further below a page that is null. Calls heard(far copy,
  // ceiling) for copies that are not walked.
  using PageOf = std::function<const ResidentPage*(const PageEntry& entry, double urgency)>;
  using Visit =
      std::function<bool(const Step& step, const ResidentPage* page, ValidityRegion& quiet)>;
  using Heard = std::function<void(const FarCopy& far, double ceiling)>;
  bool walk(const Vec3& place, double threshold, const PageOf& page_of, const Visit& visit,
            const Heard& heard);
  void add_steps(const Step& from, const ResidentPage& page, double threshold,
                 ValidityRegion& quiet);
  void add_copies(const Step& from, const ResidentPage& page, double threshold, const Heard& heard);
  double most_of_lead(const InstanceRepresentative& lead, std::uint32_t signal,
                      double representative_key, const Vec3& place, double to_level) const;
  void add_source(const Step& step, const Source* sources, std::size_t index, bool leads,
                  std::uint32_t signal, double ceiling, float boost, double least,
                  std::vector<FoundSource>& found);
  void note_missing(const Step& step, double most, double to_threshold);
  bool look_by_plan(const Vec3& place, double threshold, std::size_t most,
                    std::vector<FoundSource>& found);
  Scope scope_of(const Vec3& place, double threshold) const;
  void find_parts_to_ask(const Vec3& place, double threshold, const Scope& scope);
  void find_lists_to_renew(double threshold, const Scope& scope);
  bool give_up_parts();
  void note_planned_missing(const PlannedNode& one, double highest, double threshold);
  bool renew_lists(const Scope& scope);
  bool ask_parts(const Scope& scope, std::size_t most);
  std::size_t pass_planned(const Scope& scope);
  void take_heard(const Plan::Part& part, double threshold, std::vector<FoundSource>& found) const;
  void plan_ahead(const Vec3& soon);
  void begin_plan(const Vec3& soon);
  void go_a_step(Plan& plan, LastNodes& last);
  void complete_plan(Plan& plan);
  bool soon_by_plan(const Vec3& soon, double tau);
  void rest_from_plans();
  void forget_plans() {
    plan_.clear();
    next_.clear();
  }
  void pass_met(std::vector<FoundSource>& found);
  // Charges what the shortlists did since the last call as well.
  bool is_exhausted() {
    spend(shortlists_.take_work());
    return SourcePool::is_exhausted();
  }
  // Behind what stands in the way, in this keyframe?
  bool is_too_quiet(double loud, float known, std::uint64_t number, double threshold) const {
    const double least = threshold * (1 - 1e-6);
    if (loud < least) return true;
    return known < 1 && loud * static_cast<double>(hidden_->upper_bound(number, known)) < least;
  }
  void add_far(const FarCopy& far, double ceiling, std::vector<FoundSource>& found);
  Source* placed(const Source& stored, const Placement& placement, double representative_key);

  void pass_without_list(const Step& step, const ResidentPage& page, double threshold,
                         std::vector<FoundSource>& found);
  bool look_without_lists(double threshold, std::size_t most, std::vector<FoundSource>& found);

  QuerySwitches on_;
  const RadiationModel& field_;
  const std::span<const PageEntry> trees_;
  const std::span<const std::vector<std::uint32_t>> signal_maps_;
  const SignalWeights& ceilings_;
  std::vector<Bands> audible_;  // what ceilings come to, from one time to another
  double from_s_ = 0, until_s_ = -1, loudest_ = 1, time_s_ = 0;
  Vec3 around_{};  // and not far from here
  PriorityBound priority_bound_;
  PageLoader& loader_;
  SignalMaps maps_;
  PageShortlists shortlists_;
  const OcclusionUpperBounds* hidden_ = nullptr;
  bool may_lag_ = false;
  std::uint32_t keyframe_ = 0;
  std::uint32_t turns_ahead_ = 0;  // keyframes that are looked for at once, but for this one,
  double ahead_s_ = 0;             // and how long they take; 0: none are
  Vec3 keyframe_place_{}, step_m_{};
  CulledNodeCache quiet_;
  InstanceRepresentatives leads_;
  Plan plan_, next_;
  std::uint32_t keyframes_to_rest_ = 0;             // without making one
  std::vector<std::uint32_t> asked_parts_;          // of it,
  std::vector<PlannedNode> due_, renewed_, heard_;  // and of its nodes
  double looked_for_ = 0;  // threshold of the last look that was not given up
  float strength_ = 1;     // of late sources' boost; copies' have none

  // Of the last look.
  std::vector<Copy> copies_;
  std::vector<Met> met_;
  std::vector<PageShortlists::Asked> asked_lists_;  // theirs
  std::deque<Source> placed_;  // the first so many; the others wait to be used again
  std::size_t placed_count_ = 0;
  std::vector<WantedPage> missed_, nearly_, soon_;
  std::uint32_t asks_ = 0;
  double most_missed_ = -1;  // of priorities in missing pages; below 0: all is here
  Vec3 place_{};

  std::vector<Step> steps_;
  std::uint64_t steps_left_ = kMostSteps;  // of this keyframe
  bool asked_ = false;
  std::uint64_t visited_ = 0, planned_ = 0, looked_at_ = 0, copies_heard_ = 0;
};

}  // namespace clamor
