/* many_sources.c: the game of project/many.gd in the C interface; prints its CPU time for each
 * second that is heard.   many_sources BAKE still|moving */
#include <clamor.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>

enum { kCount = 1000, kRate_hz = 48000, kBlock = 512 };
static const double kBegin_s = 3, kSeconds = 10;

static double cpu_s(void) {
  struct rusage usage;
  getrusage(RUSAGE_SELF, &usage);
  return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

static void place(int i, double moved_m, double* at) {
  at[0] = i % 10 * 0.3 - 1.5;
  at[1] = 0.5 + i / 100 * 0.2;
  at[2] = i / 10 % 10 * 0.4 - 3 + moved_m;
}

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const int is_moving = strcmp(argv[2], "moving") == 0;
  clamor_context* context;
  clamor_listener ears;
  clamor_error error;
  clamor_level level;
  clamor_sound sound;
  static clamor_source sources[kCount];
  static float samples[kRate_hz];
  for (int i = 0; i < kRate_hz; ++i) samples[i] = (float)(i * 7919LL % 16384 - 8192) / 32767;
  const clamor_options options = {sizeof options, .caller_updates = 1, .max_sources = 4096};
  const clamor_listener_options listener = {sizeof listener, .rate_hz = kRate_hz, .limits = 1,
                                            .offline = 1, .pose = {{0, 1.75, 1}, {0}}};
  const clamor_sound_options looped = {sizeof looped, .rate_hz = kRate_hz, .loops = 1};
  if (clamor_create(&options, &context, &error) != CLAMOR_OK ||
      clamor_open_level(context, argv[1], &level, &error) != CLAMOR_OK ||
      clamor_create_listener(context, level, &listener, &ears, &error) != CLAMOR_OK ||
      clamor_add_sound(context, samples, kRate_hz, &looped, &sound, &error) != CLAMOR_OK) {
    fprintf(stderr, "%s\n", error.sentence);
    return 1;
  }
  for (int i = 0; i < kCount; ++i) {
    clamor_source_options source = {sizeof source, .sound = sound, .gain = pow(10, -2.5)};
    place(i, 0, source.motion.position_m);
    if (clamor_add_source(context, &source, &sources[i]) != CLAMOR_OK) return 1;
  }
  double begin_cpu_s = 0, frame_s = 0, heard_s = 0;
  for (; heard_s < kBegin_s + kSeconds; heard_s += (double)kBlock / kRate_hz) {
    if (begin_cpu_s == 0 && heard_s > kBegin_s) begin_cpu_s = cpu_s();
    for (; frame_s < heard_s; frame_s += 1 / 60.0) {
      for (int i = 0; is_moving && i < kCount; ++i) {
        clamor_motion motion = {{0}, {0}, {0}};
        place(i, 0.2 * sin(frame_s), motion.position_m);
        clamor_move_source(context, sources[i], &motion);
      }
      clamor_move_listener(context, ears, &listener.pose);
    }
    uint32_t wanted = 0;
    double time_s = 0;
    while (clamor_next_keyframe(context, ears, &wanted, &time_s) == CLAMOR_OK && wanted != 0) {
      clamor_commit(context, time_s);
      clamor_update(context, 0, NULL);
    }
    float block[2 * kBlock];
    clamor_render(context, ears, block, kBlock);
  }
  printf("%.4f\n", (cpu_s() - begin_cpu_s) / kSeconds);
  clamor_destroy(context);
  return 0;
}
