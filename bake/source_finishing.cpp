#include "bake/source_finishing.h"

#include <cstddef>
#include <memory>
#include <utility>

#include "bake/instances/instance_tree.h"
#include "bake/octree/octree_builder.h"
#include "bake/octree/octree_streaming.h"
#include "bake/octree/patch_radius.h"
#include "common/thread_team.h"
#include "formats/bake_file/source_quantization.h"

namespace clamor {

namespace {

void quantize_on_all_threads(std::span<Source> sources, std::span<const Material> materials) {
  team_for_parts(sources.size(), 1024, [&](std::size_t first, std::size_t end) {
    quantize_sources(sources.subspan(first, end - first), materials);
  });
}

}  // namespace

Result<void> finish_sources(ScratchList<Source>& secondary_sources, const PortalPairs& portals,
                            std::span<const Material> materials, std::uint64_t step_bytes) {
  auto radii_m = find_patch_radii(secondary_sources, step_bytes);
  if (!radii_m.ok()) return radii_m.error();
  secondary_sources.for_blocks([&](std::span<Source> sources, std::size_t first) {
    for (std::size_t i = 0; i < sources.size(); ++i)
      sources[i].patch_radius_m = radii_m->all()[first + i];
    radii_m->release(first, sources.size());
    portals.apply(sources);
    quantize_on_all_threads(sources, materials);
  });
  return {};
}

void sort_sources(ScratchList<Source> sources, EmitterInstances& instances,
                  std::uint64_t step_bytes, BakeContents& contents) {
  if (!sources.is_in_file()) {
    contents.octree = with_instances(build_octree(std::move(sources).take_vector()),
                                     std::move(instances.instances), instances.tops);
    return;
  }
  contents.octree = instance_tree(std::move(instances.instances), instances.tops);
  contents.streamed_sources = sources.size();
  contents.stream_octree = [list = std::make_shared<ScratchList<Source>>(std::move(sources)),
                            step_bytes](OctreeSink& sink) {
    return stream_octree(std::move(*list), step_bytes, sink);
  };
}

}  // namespace clamor
