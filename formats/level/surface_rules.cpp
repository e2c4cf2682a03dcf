#include "formats/level/surface_rules.h"

#include <algorithm>
#include <array>
#include <charconv>

#include "formats/level/name_match.h"

namespace clamor {

namespace {

using enum NoSurface;

// Unreal Engine: UBX_, UCP_, USP_, UCX_ (FBX static mesh pipeline), MCDCX_. Godot: -col to -noimp
// (import hints of node names, also with $ or _). The others are habits of many tools.
constexpr std::array kRules = {
    SurfaceRule{"ubx_*", kCollisionHull},
    SurfaceRule{"ucp_*", kCollisionHull},
    SurfaceRule{"usp_*", kCollisionHull},
    SurfaceRule{"ucx_*", kCollisionHull},
    SurfaceRule{"mcdcx_*", kCollisionHull},
    SurfaceRule{"*_colonly", kCollisionHull},
    SurfaceRule{"*_convcolonly", kCollisionHull},
    SurfaceRule{"*_rigidonly", kCollisionHull},
    SurfaceRule{"*_col", kCollisionHull, true},
    SurfaceRule{"*_convcol", kCollisionHull, true},
    SurfaceRule{"*_collision", kCollisionHull},
    SurfaceRule{"*_collider", kCollisionHull},
    SurfaceRule{"collision_*", kCollisionHull},
    SurfaceRule{"collider_*", kCollisionHull},
    SurfaceRule{"collision", kCollisionHull},
    SurfaceRule{"collider", kCollisionHull},
    SurfaceRule{"*_navmesh", kNavigationMesh},
    SurfaceRule{"navmesh_*", kNavigationMesh},
    SurfaceRule{"navmesh", kNavigationMesh},
    SurfaceRule{"nav_mesh", kNavigationMesh},
    SurfaceRule{"trigger_*", kTrigger},
    SurfaceRule{"*_trigger", kTrigger},
    SurfaceRule{"*_occonly", kOccluder},
    SurfaceRule{"*_occ", kOccluder, true},
    SurfaceRule{"*_noimp", kIgnored},
};

// Words that name a sky, and words that may stand beside "sky" without making it something else.
constexpr std::array<std::string_view, 6> kSkies = {"sky",       "skybox",  "skydome",
                                                    "skysphere", "skyball", "skymesh"};
constexpr std::array<std::string_view, 46> kBesideSky = {
    "background", "backdrop", "ball",    "big",    "blue",     "box",      "bg",     "clear",
    "cloud",      "clouds",   "cloudy",  "colour", "color",    "cube",     "day",    "default",
    "dome",       "env",      "evening", "geo",    "geometry", "gradient", "hdr",    "hdri",
    "hemisphere", "inner",    "m",       "mat",    "material", "mesh",     "mi",     "model",
    "morning",    "night",    "obj",     "object", "outer",    "root",     "shader", "shape",
    "sm",         "sphere",   "star",    "stars",  "sunset",   "unlit"};

char normalized(char c) {
  if (c == '-' || c == '.' || c == '$' || c == ' ') return '_';
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The number that Blender adds to a name that is there twice: "Wall.001".
std::string_view without_copy_number(std::string_view name) {
  if (name.size() > 4 && name[name.size() - 4] == '.' &&
      std::all_of(name.end() - 3, name.end(), is_digit))
    name.remove_suffix(4);
  return name;
}

std::string normalized(std::string_view name) {
  name = without_copy_number(name);
  std::string text;
  for (const char c : name) text += normalized(c);
  return text;
}

// "walls_col_02" ends with the hint "_col" as well; Godot reads it so.
std::string_view without_number(std::string_view name) {
  while (!name.empty() && (is_digit(name.back()) || name.back() == '_')) name.remove_suffix(1);
  return name;
}

struct Detail {
  std::string owner;  // the name without the number of its level of detail
  int level = 0;
};

// Reads "tree_lod2".
std::optional<Detail> detail_of(std::string_view name) {
  const std::size_t at = name.rfind("lod");
  if (at == std::string_view::npos) return std::nullopt;
  std::size_t digits = at + 3;
  if (digits < name.size() && name[digits] == '_') ++digits;
  Detail detail;
  const char* const end = name.data() + name.size();
  const auto [rest, wrong] = std::from_chars(name.data() + digits, end, detail.level);
  if (wrong != std::errc() || rest != end || detail.level < 0) return std::nullopt;
  detail.owner = name.substr(0, at);
  if (detail.owner.ends_with('_')) detail.owner.pop_back();
  return detail;
}

}  // namespace

std::string_view in_words(NoSurface reason) {
  constexpr std::array<std::string_view, kNoSurfaceReasons> kWords = {"surface",
                                                                      "mesh to be ignored",
                                                                      "hidden mesh",
                                                                      "collision hull",
                                                                      "navigation mesh",
                                                                      "trigger volume",
                                                                      "occluder for rendering",
                                                                      "lower level of detail",
                                                                      "sky",
                                                                      "fully transparent material",
                                                                      "prop of an emitter"};
  return kWords[static_cast<std::size_t>(reason)];
}

std::span<const SurfaceRule> surface_rules() { return kRules; }

std::string surface_rule_in_words(NoSurface reason) {
  std::string text;
  const auto add = [&text](std::string_view words) {
    text.append(text.empty() ? "" : ", ").append(words);
  };
  for (const SurfaceRule& rule : kRules)
    if (rule.reason == reason) {
      add(rule.pattern);
      if (rule.needs_visible_mesh) text += " beside the mesh itself";
    }
  switch (reason) {
    case kIgnored:
      add("--ignore and the sidecar's \"ignored\"");
      break;
    case kHidden:
      add("KHR_node_visibility, visible of extras and of MOZ_hubs_components");
      break;
    case kNavigationMesh:
      add("nav-mesh of MOZ_hubs_components");
      break;
    case kLevelOfDetail:
      add("*_lod1 and above beside a finer one, MSFT_lod");
      break;
    case kSky:
      add("sky, skybox, skydome, skysphere; also as materials; an unlit shell round all else");
      break;
    case kTransparent:
      add("alpha 0 of a masked or blended material");
      break;
    case kPropOfEmitter:
      add("a mesh round its emitter, of the same object or at most half a metre long");
      break;
    default:
      break;
  }
  return text;
}

void MeshNames::add(std::string_view name, bool has_mesh) {
  const std::string plain = normalized(name);
  has_mesh_[plain] |= has_mesh;
  const auto detail = detail_of(plain);
  if (!detail) return;
  const auto [finest, is_new] = finest_detail_.try_emplace(detail->owner, detail->level);
  if (!is_new) finest->second = std::min(finest->second, detail->level);
}

const SurfaceRule* MeshNames::rule_for(std::string_view name, std::string& owner) {
  const std::string plain = normalized(name);
  const std::string_view end = without_number(plain);
  for (const SurfaceRule& rule : kRules) {
    const bool matches = glob_matches(rule.pattern, plain) ||
                         (end.size() < plain.size() && glob_matches(rule.pattern, end));
    if (!matches) continue;
    if (rule.needs_visible_mesh) owner = end.substr(0, end.size() - (rule.pattern.size() - 1));
    return &rule;
  }
  return nullptr;
}

bool MeshNames::has_visible(const std::string& name) const {
  const auto known = has_mesh_.find(name);
  return known != has_mesh_.end() && known->second;
}

NoSurface MeshNames::reason_for(std::string_view name) const {
  std::string owner;
  const SurfaceRule* const rule = rule_for(name, owner);
  if (rule != nullptr && (!rule->needs_visible_mesh || has_visible(owner))) return rule->reason;
  if (is_sky(name)) return kSky;
  const auto detail = detail_of(normalized(name));
  if (!detail || detail->level == 0) return kNothing;
  const auto finest = finest_detail_.find(detail->owner);
  const bool is_lower = (finest != finest_detail_.end() && finest->second < detail->level) ||
                        has_visible(detail->owner);
  return is_lower ? kLevelOfDetail : kNothing;
}

bool MeshNames::is_lone(std::string_view name) const {
  std::string owner;
  const SurfaceRule* rule = rule_for(name, owner);
  return rule != nullptr && rule->needs_visible_mesh && reason_for(name) == kNothing;
}

bool is_sky(std::string_view name) {
  const NameLetters split = letters_of(name);
  if (split.letters.find("sky") == std::string::npos) return false;
  bool named = false;
  for (std::size_t first = 0, end = 0; first < split.letters.size(); first = end) {
    do ++end;
    while (!split.begins[end]);
    const std::string_view word = std::string_view(split.letters).substr(first, end - first);
    const auto is_word = [&word](std::string_view known) { return known == word; };
    if (std::ranges::any_of(kSkies, is_word))
      named = true;
    else if (std::ranges::none_of(kBesideSky, is_word))
      return false;
  }
  return named;
}

SurfaceChoice::SurfaceChoice(std::vector<SurfacePatterns> origins) {
  for (auto origin = origins.rbegin(); origin != origins.rend(); ++origin) {
    for (std::string& glob : origin->kept) patterns_.push_back({std::move(glob), true, false});
    for (std::string& glob : origin->ignored) patterns_.push_back({std::move(glob), false, false});
  }
}

std::optional<bool> SurfaceChoice::keeps(std::string_view name) {
  std::optional<bool> keeps;
  for (Pattern& pattern : patterns_) {
    if (!glob_matches(pattern.glob, name)) continue;
    pattern.is_used = true;
    if (!keeps) keeps = pattern.keeps;
  }
  return keeps;
}

std::vector<std::string> SurfaceChoice::unused() const {
  std::vector<std::string> globs;
  for (const Pattern& pattern : patterns_)
    if (!pattern.is_used) globs.push_back(pattern.glob);
  return globs;
}

}  // namespace clamor
