// Linked into the thread tests under ThreadSanitizer. oneTBB and Embree as Debian builds them are
// not instrumented: it sees none of their hand-overs and takes what a task wrote for a race with
// whoever waits for it. So tasks, which only the bake, the file's writer and Embree's own building
// use, stay on the thread that asks for them; the threads under test, those that play, use none.

#include <tbb/global_control.h>

namespace {

const tbb::global_control no_workers(tbb::global_control::max_allowed_parallelism, 1);

}  // namespace
