/* clamor_bake.h: bakes levels from within an application: a glTF file, or the caller's triangles.
 *
 *   clamor_bake_level* level;
 *   clamor_bake_error error;
 *   clamor_bake_read_level("hall.glb", NULL, &level, &error);
 *   clamor_bake_to_file(level, NULL, "hall.clamor", NULL, &error);
 *   clamor_bake_destroy_level(level);
 *
 * The file has the bytes that `clamor bake hall.glb -o hall.clamor` writes. clamor.h plays it; the
 * two libraries do not need each other. A bake needs no listener: a baked level is heard from
 * everywhere.
 *
 * THREADS. Any thread may call any function, but those that change a level, or destroy it, must be
 * alone with it. Several threads may bake one level at once. A bake works on its own threads while
 * the calling thread waits and calls the callbacks, so that callbacks are never called elsewhere.
 * Threads of the library sleep between bakes, so it stays loaded after dlclose().
 *
 * ERRORS. Functions return CLAMOR_BAKE_OK or a negative code, and have then changed nothing: they
 * leave no file but the journal, and an older file is as it was. They write a sentence into a
 * clamor_bake_error, which may be null. No C++ exception leaves the library. It installs no signal
 * handlers, prints nothing and reads no locale. The pointer to a level is valid until
 * clamor_bake_destroy_level(); sounds and materials are numbers, which are checked.
 *
 * STRUCTURES begin with `bytes`, their size as the caller knows it: later versions append members.
 * Members that are 0 mean the default, which brackets tell. Strings are UTF-8 and copied.
 *
 * UNITS. Metres and seconds, +Y up and right-handed as in glTF. Values for each band are eight
 * floats, for the octave bands of 63, 125, 250, 500, 1000, 2000, 4000 and 8000 Hz.
 */
#ifndef CLAMOR_BAKE_H
#define CLAMOR_BAKE_H

#include <stddef.h>
#include <stdint.h>

#define CLAMOR_BAKE_VERSION_MAJOR 0
#define CLAMOR_BAKE_VERSION_MINOR 1
#define CLAMOR_BAKE_VERSION_PATCH 0
/* Programs run with every library of the same ABI version that is not older than their header. */
#define CLAMOR_BAKE_ABI_VERSION 0

#define CLAMOR_BAKE_BANDS 8

#if defined(CLAMOR_BUILDS_BAKE_LIBRARY) && defined(_WIN32)
#define CLAMOR_BAKE_API __declspec(dllexport)
#elif defined(CLAMOR_BUILDS_BAKE_LIBRARY) && defined(__GNUC__)
#define CLAMOR_BAKE_API __attribute__((visibility("default")))
#else
#define CLAMOR_BAKE_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Results ------------------------------------------------------------------------------- */

/* Codes that clamor.h has too have its values. */
typedef int32_t clamor_bake_result;
enum {
  CLAMOR_BAKE_OK = 0,
  CLAMOR_BAKE_ERROR_ARGUMENT = -1, /* null, not finite, out of range, or without its size */
  CLAMOR_BAKE_ERROR_FILE = -3,     /* cannot be read or written, or is damaged */
  CLAMOR_BAKE_ERROR_MEMORY = -4,   /* there is not enough, or options.memory_bytes is too low */
  CLAMOR_BAKE_ERROR_INTERNAL = -8, /* a fault of the library; please report it */
  CLAMOR_BAKE_ERROR_LEVEL = -9,    /* the level has neither emitters nor probes to bake */
  CLAMOR_BAKE_ERROR_CANCELLED = -10,
  CLAMOR_BAKE_ERROR_WARNINGS = -11 /* there were warnings, and options.strict is set */
};

typedef struct clamor_bake_error {
  clamor_bake_result code;
  char sentence[1020]; /* UTF-8, ends with a zero */
} clamor_bake_error;

/* A short text for a code. Any thread; never null. */
CLAMOR_BAKE_API const char* clamor_bake_result_text(clamor_bake_result result);

/* The library's version, as major << 16 | minor << 8 | patch, and its ABI version. Any thread. */
CLAMOR_BAKE_API uint32_t clamor_bake_version(void);
CLAMOR_BAKE_API uint32_t clamor_bake_abi_version(void);

/* ---- Levels -------------------------------------------------------------------------------- */

/* Triangles, materials, sounds and emitters. Levels do not see each other. */
typedef struct clamor_bake_level clamor_bake_level;

/* Options of a level that is read from a file, as those of `clamor bake`. */
typedef struct clamor_bake_level_options {
  uint32_t bytes;
  uint32_t hidden_meshes; /* 1: --hidden: with the meshes that the level marks as hidden */
  const char* acoustics;  /* --acoustics: the sidecar [LEVEL.acoustics.json, if it exists] */
  const char* material;   /* --material: preset for materials without acoustic data [plaster] */
  const char* const* emitters; /* --emitter, as "name=violin,signal=violin.flac,at=1,1.2,-3" */
  uint64_t emitter_count;      /* length of that array */
} clamor_bake_level_options;

/* Reads a .gltf or .glb file with its sidecar and sounds. Errors: ARGUMENT, FILE, MEMORY. Blocks on
 * the disk; a second for each million triangles and each ten minutes of sound. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_read_level(const char* path,
                                                          const clamor_bake_level_options* options,
                                                          clamor_bake_level** level,
                                                          clamor_bake_error* error);

/* Makes an empty level. The file tells its name, as it tells that of a glTF file; null: "level".
 * Errors: ARGUMENT, MEMORY. Microseconds. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_create_level(const char* name,
                                                            clamor_bake_level** level,
                                                            clamor_bake_error* error);

/* Frees the level. No other call with it may be under way. Null is allowed. */
CLAMOR_BAKE_API void clamor_bake_destroy_level(clamor_bake_level* level);

/* Null pointers to values mean those of the preset; without one, `absorption` must be given. */
typedef struct clamor_bake_material {
  uint32_t bytes;
  const char* name;          /* [the preset's] */
  const char* preset;        /* as `clamor materials` lists them, or null */
  const float* absorption;   /* share of the incident power that is not reflected, 0 to 1 */
  const float* scattering;   /* share of the reflected power that is diffuse, 0 to 1 [1, or 0 if
                                `phong` is given] */
  const float* phong;        /* exponent of the specular lobe, 0 to 1000 [10000: a mirror] */
  const float* transmission; /* share of the incident power, at most the absorption [0] */
} clamor_bake_material;

/* Adds a material and writes its number to `material`. Errors: ARGUMENT (also without such a
 * preset; the sentence tells the nearest name), MEMORY. Microseconds. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_add_material(clamor_bake_level* level,
                                                            const clamor_bake_material* values,
                                                            uint32_t* material,
                                                            clamor_bake_error* error);

/* The name of a preset, or null if `index` is not less than their number. */
CLAMOR_BAKE_API const char* clamor_bake_preset_name(uint32_t index);

/* Adds triangles, which reflect on both sides. `vertices_m` has three floats for each vertex, at
 * most 100 000 km from the origin, and `indices` three for each triangle; null: the vertices in their
 * order. `material` is a number that clamor_bake_add_material() wrote. Triangles without area are
 * left out. Errors: ARGUMENT, MEMORY. 0.1 s for a million triangles. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_add_triangles(
    clamor_bake_level* level, const float* vertices_m, uint64_t vertex_count,
    const uint32_t* indices, uint64_t triangle_count, uint32_t material, clamor_bake_error* error);

/* A sound is a file, a test signal, or samples of the caller's. */
typedef struct clamor_bake_sound {
  uint32_t bytes;
  uint32_t plays_once;  /* 1: from the emitter's delay on; 0: it loops */
  const char* name;     /* [the file's] */
  const char* path;     /* WAV, FLAC, Ogg or MP3, or "noise" (pink) or "impulse" */
  const float* samples; /* instead of `path`: mono, 1 at full scale */
  uint64_t frames;      /* at most 30 minutes */
  uint32_t rate_hz;     /* other rates are resampled to 48 kHz [48000] */
} clamor_bake_sound;

/* Adds a sound and writes its number to `sound`. The file keeps only sounds that an emitter plays.
 * Errors: ARGUMENT, FILE, MEMORY. Blocks on the disk; 0.1 s for each minute. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_add_sound(clamor_bake_level* level,
                                                         const clamor_bake_sound* values,
                                                         uint32_t* sound, clamor_bake_error* error);

typedef struct clamor_bake_emitter {
  uint32_t bytes;
  uint32_t sound;   /* number that clamor_bake_add_sound() wrote */
  const char* name; /* differs from those of the level's other emitters [the sound's] */
  double position_m[3];
  double facing[3]; /* axis of the directivity, of any length [0, 0, -1] */
  double gain;      /* amplitude at 1 m on the axis [1] */
  /* Exponent p of the intensity ((1 + cos a) / 2)^p at an angle a to the axis, 0 to 1000: 0 is
   * omnidirectional, 1 a cardioid. */
  double directivity;
  const float* directivity_bands; /* instead of `directivity`, for each band; or null */
  double delay_s;                 /* start of the sound, a phase if it loops; at most 3600 */
} clamor_bake_emitter;

/* Errors: ARGUMENT, MEMORY. Microseconds. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_add_emitter(clamor_bake_level* level,
                                                           const clamor_bake_emitter* values,
                                                           clamor_bake_error* error);

typedef struct clamor_bake_air {
  uint32_t bytes;
  double temperature_c, humidity_percent, pressure_kpa; /* zeros are zeros, not defaults */
} clamor_bake_air;

/* The air is that of the sidecar, or at 20 C, 50 % and 101.325 kPa. Errors: ARGUMENT. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_set_air(clamor_bake_level* level,
                                                       const clamor_bake_air* air,
                                                       clamor_bake_error* error);

typedef struct clamor_bake_level_info {
  uint32_t bytes;
  uint32_t materials, sounds, emitters;
  uint64_t triangles;
  float low_m[3], high_m[3]; /* bounds of the triangles; zeros without any */
} clamor_bake_level_info;

/* Errors: ARGUMENT. 10 ms for a million triangles. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_get_level_info(const clamor_bake_level* level,
                                                              clamor_bake_level_info* info);

/* ---- Bake ---------------------------------------------------------------------------------- */

enum {
  CLAMOR_BAKE_PREPARING = 0, /* welds and checks the triangles, builds a BVH, plans the photons */
  CLAMOR_BAKE_TRACING = 1,
  CLAMOR_BAKE_SORTING = 2, /* sorts the sources into an octree */
  CLAMOR_BAKE_WRITING = 3
};

typedef struct clamor_bake_progress {
  uint32_t bytes;
  uint32_t phase;  /* CLAMOR_BAKE_PREPARING to _WRITING; a goal repeats the second and third */
  double fraction; /* share of the photons that are done, 0 to 1 */
  uint64_t photons, photons_total;
  uint64_t photons_reused; /* of `photons`: taken from the journal */
  uint64_t bounces;        /* of the traced photons */
  uint64_t escaped;        /* photons that left the level */
  double bounces_per_s;
  double error_db; /* standard error of the energy decay; 0: not yet known */
  double seconds;  /* since the bake began */
} clamor_bake_progress;

enum {
  CLAMOR_BAKE_NOTE = 0,   /* what was found in the level, and how it was understood */
  CLAMOR_BAKE_WARNING = 1 /* the file keeps those about the level */
};

typedef struct clamor_bake_options {
  uint32_t bytes;
  uint32_t threads;         /* 1 to 1024; does not change the file [all cores] */
  uint64_t seed;            /* of all random numbers [the sidecar's, or 1] */
  uint64_t photons;         /* to trace, at most 4e9 [the sidecar's, or enough for `sources`] */
  uint64_t sources;         /* secondary sources to keep at most, at most 2e8
                               [200 000 for each room with emitters] */
  double goal_error_db;     /* instead of photons and sources: bake until the energy decay is known
                               this well, */
  double goal_s;            /* or for about this long */
  double simplify_m;        /* remove triangles and move no surface further than this [0: off] */
  double roulette_exponent; /* of Russian roulette, at most 1 [0.15] */
  double longest_path_s;    /* at most 60 [10, or what a slow decay takes] */
  uint64_t memory_bytes;    /* what exceeds it is kept in temporary files beside the output, if
                               that is a file; a bake that needs more even then is refused [any] */
  uint32_t no_instances;    /* 1: store emitter groups that the level repeats once each */
  uint32_t strict;          /* 1: warnings are an error, and nothing is written */
  /* A file that keeps traced paths, so that a bake that was cancelled or changed in its emitters
   * does not trace them again. The command's is OUTPUT.journal. One bake at a time may use it. */
  const char* journal;
  void* user; /* for the callbacks, which may be null */
  /* Called about ten times a second, also where nothing has changed. Another number than 0 cancels
   * the bake, which then ends within a second, or a few of them if the level has millions of
   * triangles: some steps, as building a BVH, cannot be interrupted. */
  int32_t (*progress)(void* user, const clamor_bake_progress* progress);
  /* Called for each sentence of the report; `kind` is CLAMOR_BAKE_NOTE or CLAMOR_BAKE_WARNING. */
  void (*message)(void* user, uint32_t kind, const char* sentence);
  uint32_t has_early_order; /* 0: the order is 3 for up to 16 emitters, and 0 for more than 256 */
  uint32_t early_order;     /* reflections by mirrors that are image sources, heard exactly and in
                               phase, 0 to 3; 0: photons trace all reflections */
  double probe_spacing_m; /* metres between places where moving sources will be heard with reflections;
                             -1: as many as suit the level [0: none but those of the level] */
} clamor_bake_options;

typedef struct clamor_bake_report {
  uint32_t bytes;
  uint32_t warnings;
  uint64_t sources;                 /* of the file, emitters and those of instances included */
  uint64_t photons, photons_reused; /* traced, and of them taken from the journal */
  uint64_t file_bytes;
  uint32_t missed_goal;                 /* 1: the goal was not reached; a warning tells why */
  float error_db;                       /* standard error of the energy decay; 0: unknown */
  float t30_s[CLAMOR_BAKE_BANDS];       /* decay time, mean of four places; 0: not measured */
  float t30_error_s[CLAMOR_BAKE_BANDS]; /* its standard error */
  double seconds;
} clamor_bake_report;

/* Bakes the level into a file, which appears when it is complete and replaces an older one. Reads a
 * glTF level once more at the end, to be sure that it has not changed. `options` and `report` may
 * be null. Errors: all. Seconds to hours; memory: bake/README.md. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_to_file(const clamor_bake_level* level,
                                                       const clamor_bake_options* options,
                                                       const char* path, clamor_bake_report* report,
                                                       clamor_bake_error* error);

/* Bakes the level into memory, the same bytes, which clamor_open_level_with() can open. Give them
 * back with clamor_bake_free(). As clamor_bake_to_file() otherwise. */
CLAMOR_BAKE_API clamor_bake_result clamor_bake_to_memory(const clamor_bake_level* level,
                                                         const clamor_bake_options* options,
                                                         void** bytes, uint64_t* byte_count,
                                                         clamor_bake_report* report,
                                                         clamor_bake_error* error);

/* Frees what clamor_bake_to_memory() returned. Null is allowed. */
CLAMOR_BAKE_API void clamor_bake_free(void* bytes);

#ifdef __cplusplus
}
#endif

#endif
