#pragma once

#include <lumihull/base/parallel.h>

#include "frame.h"

namespace lumihull::slf {

/// Colours every sample by `color_of(sample)`. edges: see Frame.
template <class ColorOf>
Rendering render_with(const View& view, const RenderOptions& options, const hull::RayScene& scene,
                      const hull::Mesh& mesh, Job& job, const ColorOf& color_of,
                      const std::vector<MeshEdge>* edges = nullptr) {
  Frame frame(view, options, mesh, scene, edges);
  job.begin("rendering", frame.tiles());
  parallel_for(
      job, frame.tiles(),
      [&](std::size_t i) {
        const Tile tile = frame.tile(i);
        const std::vector<SurfaceSample> samples = frame.trace(tile);
        std::vector<BlendColor> colors(samples.size());
        for (std::size_t s = 0; s < samples.size(); ++s) colors[s] = color_of(samples[s]);
        frame.resolve(tile, samples, colors);
      },
      true);
  job.end();
  return frame.finish();
}

}  // namespace lumihull::slf
