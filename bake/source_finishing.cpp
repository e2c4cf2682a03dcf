#include "bake/source_finishing.h"

#include <cstddef>
#include <memory>
#include <utility>

#include "bake/instances/instance_tree.h"
#include "bake/octree/octree_builder.h"
#include "bake/octree/octree_streaming.h"
#include "bake/octree/patch_radius.h"
#include "bake/octree/patch_radius_on_disk.h"
#include "bake/octree/scratch_file.h"
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

void finish_sources(std::span<Source> secondary_sources, std::span<const Material> materials) {
  set_patch_radii(secondary_sources);
  quantize_on_all_threads(secondary_sources, materials);
}

void sort_sources(std::vector<Source> sources, EmitterInstances& instances,
                  BakeContents& contents) {
  contents.octree = with_instances(build_octree(std::move(sources)), std::move(instances.instances),
                                   instances.tops);
}

Result<void> finish_on_disk(BatchTracing::Output& traced, const BakeOptions& options,
                            std::uint64_t step_bytes, std::span<const Material> materials,
                            SourceSpill& list) {
  if (!traced.on_disk) return {};
  ScratchFile radii_file(options.spill);
  const auto radii =
      patch_radii_on_disk([&](const auto& visit) { return traced.on_disk->for_each(visit); },
                          [&](const auto& visit) { return traced.on_disk->for_some(visit); },
                          traced.on_disk->kept(), step_bytes, options.spill, radii_file);
  if (!radii.ok()) return radii.error();
  std::size_t next = 0;
  const auto moved = traced.on_disk->for_each([&](std::span<Source> sources) -> Result<void> {
    if (options.is_stopped()) return Error("stopped");
    for (Source& source : sources) source.patch_radius_m = (*radii)[next++];
    traced.portals.apply(sources);
    quantize_on_all_threads(sources, materials);
    return list.append(sources);
  });
  traced.on_disk.reset();
  return moved;
}

void sort_on_disk(SourceSpill list, EmitterInstances& instances, std::uint64_t step_bytes,
                  BakeContents& contents) {
  contents.octree = instance_tree(std::move(instances.instances), instances.tops);
  auto spill = std::make_shared<SourceSpill>(std::move(list));
  contents.streamed_sources = spill->count();
  contents.stream_octree = [spill, step_bytes](OctreeSink& sink) {
    return stream_octree(std::move(*spill), step_bytes, sink);
  };
}

}  // namespace clamor
