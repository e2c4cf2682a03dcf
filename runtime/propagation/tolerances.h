// tolerances.h: the tolerances and budgets of sampling, with units and reasons.
//
// Those that one algorithm alone is built around stay beside it (load_control.h, keyframe_lead.h,
// the bake's probe placement). Bounds are computed in single precision and compared with exact
// priorities, so each is enlarged by a slack that covers its rounding. A slack that is too small
// loses sources; one that is larger than necessary costs a few more tests.
#pragma once

#include <cstddef>
#include <cstdint>

namespace clamor {

// --- Upper bounds of sources --------------------------------------------------------------------
constexpr double kFloatSlack = 1.00001;       // sums and products of a few floats
constexpr float kBoundRounding = 2e-6f;       // a few operations in single precision
constexpr float kBoundSlack = 1.0005f;        // the exponential, and sums
constexpr float kMinBoundDistance_m = 1e-4f;  // nearer, the direction is unknown
constexpr float kRadius2Slack = 1 - 1e-6f;    // the square of a radius
constexpr double kCullThreshold = 1 - 1e-6;   // a threshold in single precision
constexpr float kMinU = 0x1p-64f;  // of permanent numbers, so that priorities stay finite

namespace query {

// --- Slacks: factors unless a unit is given -----------------------------------------------------
constexpr double kNodeBoundSlack = 1.0001;        // keys, boxes and distances of nodes, float
constexpr double kRepresentativeSlack = 1.0001;   // upper bound of a representative, float
constexpr double kThresholdSlack = 1e-6;          // thresholds are lowered by this share
constexpr double kBoostSlack = 1e-6;              // undoing the late boost of an upper bound
constexpr double kInstanceThresholdSlack = 1e-5;  // a threshold in the space of an instance
constexpr double kEmptyNodeSlack = 1e-9;          // the threshold above which a node is empty
constexpr double kPositionError_m = 0.002;        // quantised positions, 10 km from the origin
constexpr double kRepresentativeError_m = 0.003;  // the same and float
constexpr double kInstanceErrorPerM = 0x1p-23;    // of an instance, per metre from the origin
constexpr double kShortlistError_m = 2e-6;        // float, within the radius of a shortlist
constexpr double kConeError = 1e-3;               // radians, and cosines change no faster
constexpr double kDelayError_s = 1e-6;            // delays of shortlists, float
constexpr double kDelayWindowMargin_s = 0.05;     // delays and envelope moments, rounded

// --- How far and how long results hold ----------------------------------------------------------
// A front holds for 2.5 times the way of the next half second, since listeners turn.
constexpr double kFrontRadiusPerPath = 2.5, kMinFrontRadius_m = 0.3, kMaxFrontRadius_m = 3;
constexpr double kFrontThreshold = 0.6;       // of the lowest recent threshold
constexpr double kFrontRenewThreshold = 0.8;  // a new one is made before the threshold falls so
constexpr double kMinFrontDuration_s = 0.3;   // a new one is made so long before the old one ends
// Nodes added per keyframe: so many, and this fraction of the present front's.
constexpr std::size_t kMinFrontSteps = 256, kFrontStepShare = 8;
constexpr std::size_t kMaxFrontNodes = 1 << 18;
constexpr std::uint32_t kFrontPause_keyframes = 100;  // after pages were dropped for want of memory
constexpr double kEmptyNodeRadius_m = 0.25;           // a node below the threshold is not retested

// A shortlist holds in a ball. Its radius is a share of the distance to its page, so that upper
// bounds are at most 10 % higher than at its centre, and its threshold a share of the lowest recent
// one. A list that had few sources or none probably keeps so few, and is cheap to test even if it
// holds further: these are most lists, and would else be made anew most often.
struct ListReach {
  double radius_per_distance, min_radius_m, threshold;
};
constexpr ListReach kListReach{1.0 / 20, 0.15, 0.9}, kShortListReach{1.0 / 12, 0.25, 0.75},
    kEmptyListReach{1.0 / 8, 0.4, 0.6};
constexpr std::uint32_t kShortList = 8;  // sources, at most
constexpr double kMaxListRadius_m = 3;
constexpr double kListLead = 0.85;           // of the radius, from the listener to the centre ahead
constexpr double kMinListDuration_s = 0.04;  // a list whose ball is left sooner holds for a place
// A threshold so many times the list's makes a shorter one. A search tries thresholds that differ
// by 4 to 16: with 3, each of them made the lists of the other anew.
constexpr double kMaxListExcess = 12;
constexpr std::uint32_t kListLifetime_keyframes = 256;  // since its last use

// Thresholds rise and fall with syllables: caches are made for the lowest of 32 to 64 keyframes.
constexpr std::uint32_t kThresholdMemory_keyframes = 32;
constexpr double kMinRecentThreshold = 1.0 / 3;  // of the present threshold

// --- Upper bounds of signals --------------------------------------------------------------------
constexpr double kSignalWindow_s = 2;        // signals are bounded for so long at a time,
constexpr double kMinSignalWindow_s = 1.25;  // and again when less is left
constexpr double kQuietShare = 0.5;          // below it, shortlists end with the window
constexpr double kPageLookAhead_s = 0.5;     // pages are requested so long before they sound

// --- Bounds of work and memory ------------------------------------------------------------------
// Nodes and instances per keyframe: a billion sources and 20 000 voices take a fifth of them; a
// forged file, in which instances double again and again, would take any number.
constexpr std::uint64_t kMaxSteps = 1 << 20;
// Sources of instances in a query without a limit, as a render's: half a kilobyte each.
constexpr std::size_t kMaxPlacedSources = 1 << 21;
constexpr std::size_t kMaxFirstPages = 256;    // pages of a tree that always stay in memory
constexpr std::size_t kMaxRequests = 256;      // pages per keyframe
constexpr std::uint32_t kLookAheadPeriod = 4;  // keyframes between two looks ahead by traversal
constexpr std::size_t kPendingPages = 64;      // their shortlists are fetched from memory together
constexpr std::size_t kPrefetchNodes = 8;      // ahead of the node being tested
constexpr std::size_t kPrefetchBlocks = 3;     // of each shortlist

}  // namespace query

// --- Visibility ---------------------------------------------------------------------------------
constexpr int kRaysPerKeyframe = 16'000;  // by default, for all sources' visibility

namespace visibility {

// An estimate's validity radius: a fraction of the source's distance, within limits, and down to a
// quarter of it where an edge partly occludes a source with a large share and visibility changes
// fastest.
constexpr double kRadiusPerDistance = 1.0 / 24, kMinRadius_m = 0.1, kMaxRadius_m = 0.4;
constexpr float kMinPartialFactor = 1.0f / 4, kPartialFactorTimesShare = 0.08f;
// Shares of the sum of all from which on direct sounds and reflections have estimates of their own:
// another direct sound changes the sum by less than 0.1 dB, and reflections change together.
constexpr float kSignificantShare = 1.0f / 50, kSignificantReflection = 1.0f / 1000;
constexpr std::uint32_t kForgetUnused_keyframes = 1500;  // half a minute
// A moving source has another number in each grid cell and whenever its slot is used again, so most
// of those that are not used will never be.
constexpr std::uint32_t kForgetUnusedMoving_keyframes = 50;
constexpr float kPredictionRate = 0.8f;  // of the way to the neighbours' mean per line test

// Cells of the grid are a quarter of the source's distance wide, from 2^kFinestLevel to
// 2^kCoarsestLevel m.
constexpr double kSizePerDistance = 1.0 / 4;
constexpr int kFinestLevel = -3, kCoarsestLevel = 5;
constexpr int kLevels = 4;                        // sizes of cells to which an estimate is added
constexpr std::uint32_t kForget_keyframes = 500;  // 10 s without a new estimate

// Predictions err by up to 0.08 (share of the power) on any walk. The change clock advances by 10
// per unit of error above that. The usual error follows with an exponential mean.
constexpr double kToleratedError = 0.08, kClockPerError = 10, kErrorLearningRate = 0.3;

// Estimates lose their whole weight where the listener moves by a tenth of the source's distance.
constexpr double kFadePerDistance = 0.1;
// A mean has at most the weight of two estimates, and predicts with that of half an estimate.
constexpr float kMaxWeight = 2, kMinWeight = 0.5f;
// Reflections take the mean of their own cell as theirs while it has lost no more than this. Beside
// a door they change faster than what is heard of a crowd.
constexpr float kFreshReflection = 0.75f;

}  // namespace visibility

// --- First reflections of moving sources --------------------------------------------------------
namespace first_reflections {

constexpr std::int64_t kReflectionRaysPerKeyframe = 1024;
constexpr std::size_t kMaxSets = 1024;       // of all sources, or one of each
constexpr double kRadiusPerDistance = 0.25;  // to the nearest surface
constexpr double kListenerRadiusPerDistance = 0.5;
constexpr double kMinRadius_m = 0.05, kMaxRadius_m = 5;
constexpr double kNearest_m = 1;  // nearer listeners make no source more urgent
// A set that was never traced is as urgent as one that its source has left by so many radii.
constexpr double kMissing = 8;
// Only so many sources have images. Those that have them count as this much louder in the choice,
// so that few change.
constexpr std::size_t kMaxImagedSources = 64;
constexpr double kHysteresis = 2;

}  // namespace first_reflections

// --- Probes around moving sources ---------------------------------------------------------------
namespace probe_choice {

constexpr double kSoftening_m = 0.25;   // added to distances, squared
constexpr float kRate = 0.15f;          // of the way to the wanted weights, per keyframe
constexpr float kLeastWeight = 0.002f;  // of a probe that is not wanted any more
constexpr std::uint8_t kBlindKeyframes = 20;
constexpr std::int64_t kProbeRaysPerKeyframe = 4000;
// A line of sight holds within this share of the distance to the nearest probe, and these limits.
constexpr double kValidPerDistance = 0.1;
constexpr float kLeastValid_m = 0.05f, kMostValid_m = 0.5f;
constexpr std::size_t kWideSearch = 64;  // probes, where none of the nearest is seen

}  // namespace probe_choice

}  // namespace clamor
