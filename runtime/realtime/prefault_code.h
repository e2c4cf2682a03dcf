// prefault_code.h: has in memory beforehand what the audio thread will run.
//
// A page that is touched for the first time stops whoever touches it, for as long as the disk
// likes. What the audio thread reads and writes has been written by whoever made it, and sounds are
// locked where the system allows; but code is read from the program's file when it first runs.
#pragma once

namespace clamor {

// Every page of the program and of its libraries. Some milliseconds.
void prefault_code();

}  // namespace clamor
