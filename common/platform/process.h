// process.h: this process and others of its machine.
//
// Threads: any.
#pragma once

#include <initializer_list>
#include <string>

namespace clamor {

// The machine's name; empty if it has none.
std::string host_name();

int process_id();

// Whether no process of this machine has that number.
bool has_ended(int process);

// Calls `counts` in each child of a fork from now on, on its only thread.
void call_in_forks(void (*counts)());

// For a program's start: makes writes to closed standard outputs and beyond limits fail, rather
// than damage files or end the program.
void prepare_to_write();

// The first of these libraries that the system finds, which stays loaded; null if there is none.
void* loaded_library(std::initializer_list<const char*> names);

// A function or variable of that library or, if that is null, of the program and what it links.
void* symbol_in(void* library, const char* name);

}  // namespace clamor
