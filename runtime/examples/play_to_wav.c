/* play_to_wav.c: plays a bake to a WAV file: play_to_wav LEVEL.clamor OUT.wav SECONDS X Y Z
 *
 * The same samples as `clamor render LEVEL.clamor -o OUT.wav --listener X,Y,Z --seconds SECONDS`.
 */
#include <clamor.h>
#include <stdio.h>
#include <stdlib.h>

enum { RATE_HZ = 48000, BLOCK_FRAMES = 480, CHANNELS = 2 };

static int failed(const clamor_error* error) {
  fprintf(stderr, "%s\n", error->sentence);
  return EXIT_FAILURE;
}

static void put(FILE* file, uint32_t value, int bytes) {
  for (; bytes-- > 0; value >>= 8) fputc((int)(value & 255), file);
}

/* The header of a WAV file of 32-bit floating-point samples. */
static void put_header(FILE* file, uint32_t frames) {
  const uint32_t frame_bytes = CHANNELS * sizeof(float), bytes = frames * frame_bytes;
  fputs("RIFF", file), put(file, 36 + bytes, 4), fputs("WAVEfmt ", file), put(file, 16, 4);
  put(file, 3, 2), put(file, CHANNELS, 2), put(file, RATE_HZ, 4);
  put(file, RATE_HZ * frame_bytes, 4), put(file, frame_bytes, 2), put(file, 32, 2);
  fputs("data", file), put(file, bytes, 4);
}

int main(int count, char** words) {
  if (count != 7) return fputs("play_to_wav LEVEL.clamor OUT.wav SECONDS X Y Z\n", stderr), 2;
  const clamor_options options = {.bytes = sizeof options, .caller_updates = 1};
  clamor_listener_options listening = {.bytes = sizeof listening, .offline = 1};
  for (int i = 0; i < 3; ++i) listening.pose.position_m[i] = atof(words[4 + i]);
  clamor_error error;
  clamor_context* clamor;
  clamor_level level;
  clamor_listener ears;
  if (clamor_create(&options, &clamor, &error) != CLAMOR_OK) return failed(&error);
  if (clamor_open_level(clamor, words[1], &level, &error) != CLAMOR_OK) return failed(&error);
  if (clamor_create_listener(clamor, level, &listening, &ears, &error) != CLAMOR_OK)
    return failed(&error);

  FILE* const file = fopen(words[2], "wb");
  if (file == NULL) return perror(words[2]), EXIT_FAILURE;
  uint32_t left = (uint32_t)(atof(words[3]) * RATE_HZ);
  put_header(file, left);
  while (left > 0) {
    const uint32_t frames = left < BLOCK_FRAMES ? left : BLOCK_FRAMES;
    float block[BLOCK_FRAMES * CHANNELS];
    uint32_t made = 1;
    while (made > 0 && clamor_update(clamor, 0, &made) == CLAMOR_OK) {
    }
    clamor_render(clamor, ears, block, frames);
    fwrite(block, CHANNELS * sizeof(float), frames, file);
    left -= frames;
  }
  clamor_destroy(clamor);
  return fclose(file) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
