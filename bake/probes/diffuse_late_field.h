// diffuse_late_field.h: makes the late reflections of a zone radiate by the cosine law.
//
// A listener is in few of the lobes of mirrors, so by the cosine law fewer sources give the same
// accuracy. But the sound that is late in a room with smooth walls is what travels to and fro on
// long free paths. By the cosine law much of it would meet the floor, the ceiling or furniture
// instead, and the air would hold less of it. The power of each source is therefore scaled so that,
// per band, the sources of about its time leave as much energy in the air as by the laws of their
// materials:
//
//   energy in the air = sum over sources of power x mean of l / c,
//
// where l is the length of a path to the next surface, but for the parts within a metre of the
// planes of both surfaces, where ISO 3382-1 puts no microphones.
//
// Threads: the caller's team.   Memory: 128 bytes per source.
#pragma once

#include <span>

#include "bake/trace/scene.h"
#include "common/reflection.h"
#include "formats/bake_file/source.h"

namespace clamor {

// Makes the sources radiate by the cosine law. Their mirror directions, which mean nothing then,
// become their normals. The result does not depend on the number of threads.
void make_diffuse(std::span<Source> sources, const Scene& scene, const ReflectionLaws& laws);

}  // namespace clamor
