/* bundle_client.c: bakes a level with libclamor_bake and plays the bake with libclamor, offline.
 *
 *   bundle_client LEVEL.glb BAKE.clamor SAMPLES    writes the bake, and a second of samples
 */
#include <stdio.h>
#include <time.h>

#include <clamor.h>
#include <clamor_bake.h>

enum { kBlocks = 100, kFrames = 480 };

static int failed(const char* what, const char* message) {
  fprintf(stderr, "%s: %s\n", what, message);
  return 1;
}

static int bake(const char* level_path, const char* bake_path) {
  clamor_bake_level* level = NULL;
  clamor_bake_error error = {0};
  clamor_bake_options options = {.bytes = sizeof options, .photons = 1000, .sources = 6000};
  if (clamor_bake_read_level(level_path, NULL, &level, &error) != 0)
    return failed("level", error.sentence);
  if (clamor_bake_to_file(level, &options, bake_path, NULL, &error) != 0)
    return failed("bake", error.sentence);
  clamor_bake_destroy_level(level);
  return 0;
}

static int play(const char* bake_path, const char* samples_path) {
  clamor_error error = {0};
  clamor_options options = {.bytes = sizeof options, .caller_updates = 1};
  clamor_listener_options ears = {
      .bytes = sizeof ears, .offline = 1, .pose = {{0, 1.7, 3}, {0, 0, 0, 1}}};
  clamor_context* context = NULL;
  clamor_level level = 0;
  clamor_listener listener = 0;
  float block[2 * kFrames];
  FILE* const file = fopen(samples_path, "wb");
  const clock_t begun = clock();
  if (file == NULL) return failed(samples_path, "cannot be written");
  if (clamor_create(&options, &context, &error) != CLAMOR_OK ||
      clamor_open_level(context, bake_path, &level, &error) != CLAMOR_OK ||
      clamor_create_listener(context, level, &ears, &listener, &error) != CLAMOR_OK)
    return failed("listener", error.sentence);
  printf("first binaural listener: %.0f ms of CPU\n",
         (double)(clock() - begun) * 1e3 / CLOCKS_PER_SEC);
  for (int i = 0; i < kBlocks; ++i) {
    if (clamor_update(context, 0, NULL) != CLAMOR_OK ||
        clamor_render(context, listener, block, kFrames) != CLAMOR_OK)
      return failed("render", "fails");
    if (fwrite(block, sizeof block, 1, file) != 1) return failed(samples_path, "is full");
  }
  clamor_destroy(context);
  return fclose(file) != 0;
}

int main(int count, char** words) {
  if (count != 4) return failed("usage", "bundle_client LEVEL.glb BAKE.clamor SAMPLES");
  return bake(words[1], words[2]) || play(words[2], words[3]);
}
