// file_kind.h: recognises files that are something else than what was asked for.
//
// A level is often a Git LFS pointer, the HTML page of a failed download or a model in another
// format. Readers that cannot read a file ask here what it is, so that the error names it and the
// step that helps.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace clamor {

enum class FileKind { kUnknown, kLevel, kBake, kSound, kHead, kOther };

// What a file is and what to do, as a predicate without a full stop: "is an FBX model; convert it
// to glTF ...". Empty if that is unknown or the wanted kind.
std::string other_kind(std::span<const std::byte> file, FileKind wanted);

}  // namespace clamor
