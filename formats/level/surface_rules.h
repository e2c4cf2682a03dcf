// surface_rules.h: which meshes and materials of a level are no surfaces: the one list of rules.
//
// Exporters write meshes that nobody sees or hears: collision hulls, navigation meshes, lower
// levels of detail, skies. Conventions for their names tell them from walls. A level or a user who
// knows better says so: patterns of `kept` and `ignored` precede every rule.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace clamor {

// Reason why triangles are no surfaces.
enum class NoSurface : std::uint8_t {
  kNothing,  // they are surfaces
  kIgnored,  // by a pattern of the sidecar or the command line
  kHidden,
  kCollisionHull,
  kNavigationMesh,
  kTrigger,
  kOccluder,
  kLevelOfDetail,
  kSky,
  kTransparent,
  kPropOfEmitter,
};
inline constexpr std::size_t kNoSurfaceReasons = 11;

// "collision hull".
std::string_view in_words(NoSurface reason);

// The names that a reason applies to: "ubx_*, ucp_*, ...".
std::string surface_rule_in_words(NoSurface reason);

// One convention for names, as in "ubx_*", without case, and with any of - . $ for each _.
struct SurfaceRule {
  std::string_view pattern;
  NoSurface reason;
  // It applies only beside the mesh that it belongs to, whose name is what the * matches: Godot
  // shows a lone 'Room-col' and makes its collider of it.
  bool needs_visible_mesh = false;
};

// The rules for names of nodes and meshes. Levels of detail and skies have rules of their own.
std::span<const SurfaceRule> surface_rules();

// The names of the nodes of a level, for rules that depend on what else is there.
class MeshNames {
 public:
  // `has_mesh`: of the node itself.
  void add(std::string_view name, bool has_mesh);

  // The reason that one of the names gives, or kNothing.
  NoSurface reason_for(std::string_view name) const;

  // Whether the name matches a rule that does not apply, since there is no other mesh.
  bool is_lone(std::string_view name) const;

 private:
  // The first rule whose pattern matches, and the name of the mesh that it then belongs to.
  static const SurfaceRule* rule_for(std::string_view name, std::string& owner);
  bool has_visible(const std::string& name) const;

  std::map<std::string, bool, std::less<>> has_mesh_;      // by normalized name
  std::map<std::string, int, std::less<>> finest_detail_;  // lowest LOD number by name without it
};

// Whether a name is that of a sky: "Sky", "SkyDome_02", "M_Skybox", but neither "Skylight" nor
// "Skyscraper". Also for materials.
bool is_sky(std::string_view name);

// Patterns for names of nodes, meshes and materials, of one origin.
struct SurfacePatterns {
  std::vector<std::string> ignored, kept;
};

// Decides by patterns whether a name is kept (true), left out (false) or undecided. Later origins
// precede earlier ones, and `kept` precedes `ignored` within one.
class SurfaceChoice {
 public:
  explicit SurfaceChoice(std::vector<SurfacePatterns> origins);

  std::optional<bool> keeps(std::string_view name);

  // Patterns that matched no name so far.
  std::vector<std::string> unused() const;

 private:
  struct Pattern {
    std::string glob;
    bool keeps, is_used;
  };
  std::vector<Pattern> patterns_;  // those that precede first
};

}  // namespace clamor
