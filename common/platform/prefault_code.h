// prefault_code.h: loads the program's code into memory before the audio thread runs it.
//
// The first access to a page of code waits for the disk. Data needs no such care: what the audio
// thread reads and writes has been written by another thread before, and sounds are locked in
// memory where the system allows it.
#pragma once

namespace clamor {

// Reads every page of the program and of its libraries. Takes some milliseconds.
void prefault_code();

// Reads every page of the library or program that contains this function. Takes less than a
// millisecond, and leaves alone what else a game has loaded.
void prefault_library_code();

}  // namespace clamor
