// process.h: this process and others of its machine.
//
// Threads: any.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace clamor {

// The machine's name; empty if it has none.
std::string host_name();

int process_id();

// Whether no process of this machine has that number.
bool has_ended(int process);

// Makes a new folder, for this user alone. The pattern ends with XXXXXX.
std::optional<std::string> make_temporary_folder(std::string pattern);

// Calls `counts` in each child of a fork from now on, on its only thread.
void call_in_forks(void (*counts)());

// What main() was given, in UTF-8, without the program's name.
std::vector<std::string> program_arguments(int argc, char** argv);

// For a program's start: makes writes to closed standard outputs and beyond limits fail, rather
// than damage files or end the program.
void prepare_to_write();

// The first of these libraries that the system finds, which stays loaded; null if there is none.
void* loaded_library(std::initializer_list<const char*> names);

// A function or variable of that library or, if that is null, of the program and what it links.
void* symbol_in(void* library, const char* name);

}  // namespace clamor
