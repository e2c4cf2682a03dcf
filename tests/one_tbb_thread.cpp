// one_tbb_thread.cpp: limits oneTBB to one thread under ThreadSanitizer.
//
// Debian's oneTBB and Embree are not instrumented: ThreadSanitizer misses their synchronization and
// reports what a task wrote as a race with the thread that waits for it. Only the bake, the file
// writer and Embree's build use tasks; the threads under test, those of playback, use none.

#include <tbb/global_control.h>

namespace {

const tbb::global_control no_workers(tbb::global_control::max_allowed_parallelism, 1);

}  // namespace
