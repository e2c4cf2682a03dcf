// page_fetch.h: reads the pages of a file for a loader.
#pragma once

#include <memory>
#include <new>
#include <utility>

#include "formats/bake_file/bake_file.h"
#include "runtime/streaming/page_loader.h"

namespace clamor {

// `make(entry, page)` makes the resident page of a stored one; it may throw std::bad_alloc. The
// file must outlive the result.
template <class Make>
PageLoader::Fetch page_fetch(const BakeFile& file, Make make) {
  return [&file, make = std::move(make)](const PageEntry& entry) -> PageLoader::Content {
    try {
      auto page = file.read_page(entry);
      if (!page.ok()) return page.error();
      return make(entry, std::move(*page));
    } catch (const std::bad_alloc&) {
      return Error(file.path() + ": a page of it finds no memory; close other programs.");
    }
  };
}

}  // namespace clamor
