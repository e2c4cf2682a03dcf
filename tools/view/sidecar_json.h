// sidecar_json.h: writes values of a level into the JSON of its sidecar, as people would write
// them.
//
// Places in the sidecar are the world's; `origin_m` is that of the level, which the values are
// relative to.
#pragma once

#include <string>
#include <string_view>

#include "common/material.h"
#include "common/vec.h"
#include "formats/files/json.h"
#include "formats/level/sidecar.h"

namespace clamor::sidecar_json {

// Four decimals are finer than any of these values is known.
Json number(double value);
Json vector(const Vec3& value);
// One number if all bands are alike.
Json bands(const Bands& values);

Json json_of(const Material& material);
Json json_of(const ListenerSpec& listener, const Vec3& origin_m);
// Writes a portal into its entry, of which other members stay, such as a comment.
void write_portal(Json& entry, const PortalSpec& portal, const Vec3& origin_m);

void set(Json& object, const std::string& key, Json value);
void unset(Json& object, std::string_view key);

// The list of that name, which is made if there is none.
Json::Array& list_of(Json& sidecar, const std::string& key);

// Sets the rule for one material, which comes first, so that no pattern is before it.
void set_rule(Json& sidecar, const std::string& material, Json values);

// The emitter's entry, which is its own if it has a signal; null if there is none.
Json* entry_of(Json& sidecar, const std::string& name);

// The file's text: one material, emitter, listener or portal a line.
std::string text_of(const Json& sidecar);

}  // namespace clamor::sidecar_json
