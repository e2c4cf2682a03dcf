/* bake_box.c: bakes a room of six walls with one whistling emitter.
 *
 *   bake_box box.clamor [PHOTONS]
 */
#include <clamor_bake.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static int32_t show(void* user, const clamor_bake_progress* progress) {
  (void)user;
  fprintf(stderr, "%3.0f %%, %.0f bounces/s\n", 100 * progress->fraction, progress->bounces_per_s);
  return 0; /* another number cancels */
}

static void fail_on(clamor_bake_result result, const clamor_bake_error* error) {
  if (result == CLAMOR_BAKE_OK) return;
  fprintf(stderr, "bake_box: %s\n", error->sentence);
  exit(1);
}

int main(int argc, char** argv) {
  static const float corners[] = {0, 0, 0, 6, 0, 0, 0, 3, 0, 6, 3, 0, /* x, y, z: 6 by 3 by 8 m */
                                  0, 0, 8, 6, 0, 8, 0, 3, 8, 6, 3, 8};
  static const uint32_t walls[] = {0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3, 0, 4, 5, 0, 5, 1,
                                   2, 3, 7, 2, 7, 6, 0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5};
  static float tone[48000];
  clamor_bake_level* level;
  clamor_bake_error error;
  clamor_bake_material plaster = {.bytes = sizeof plaster};
  clamor_bake_sound sound = {.bytes = sizeof sound};
  clamor_bake_emitter whistle = {.bytes = sizeof whistle};
  clamor_bake_options options = {.bytes = sizeof options};
  clamor_bake_report report = {.bytes = sizeof report};
  uint32_t material;
  if (argc < 2) return 2;
  for (int i = 0; i < 48000; ++i) tone[i] = 0.1f * (float)sin(i * 6.28318530718 * 880 / 48000);

  fail_on(clamor_bake_create_level("box", &level, &error), &error);
  plaster.preset = "plaster";
  fail_on(clamor_bake_add_material(level, &plaster, &material, &error), &error);
  fail_on(clamor_bake_add_triangles(level, corners, 8, walls, 12, material, &error), &error);
  sound.name = "tone", sound.samples = tone, sound.frames = 48000;
  fail_on(clamor_bake_add_sound(level, &sound, &whistle.sound, &error), &error);
  whistle.position_m[0] = 2, whistle.position_m[1] = 1.5, whistle.position_m[2] = 3;
  fail_on(clamor_bake_add_emitter(level, &whistle, &error), &error);

  options.photons = argc > 2 ? strtoul(argv[2], NULL, 10) : 0;
  options.progress = show;
  fail_on(clamor_bake_to_file(level, &options, argv[1], &report, &error), &error);
  printf("%s: %llu sources, T30 %.2f s at 1 kHz\n", argv[1], (unsigned long long)report.sources,
         report.t30_s[4]);
  clamor_bake_destroy_level(level);
  return 0;
}
