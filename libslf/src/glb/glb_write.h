#pragma once

// The parts that a glTF binary is written from, for all models that are.

#include <lumihull/internal/json.h>
#include <lumihull/slf/glb.h>
#include <lumihull/slf/textured_mesh.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace lumihull::slf {

/// Corners that share a vertex and a place in the texture are one vertex of the file.
struct FileVertices {
  std::vector<std::uint32_t> vertex;  // of the mesh
  std::vector<Eigen::Vector2f> uv;
  std::vector<std::uint32_t> indices;
};

FileVertices split_vertices(const TexturedMesh& textured);

/// Views into the binary buffer and the accessors over them, as they are added.
class GlbBuffer {
 public:
  /// target: 34962 vertex attributes, 34963 indices, 0 anything else. Returns the new view's index. Every view starts
  /// at a multiple of four.
  std::size_t add_view(const void* data, std::size_t bytes, int target = 0);
  std::size_t add_accessor(internal::Json accessor);
  std::size_t add_vectors(const std::vector<Eigen::Vector3f>& values, bool bounds, int target = 34962);
  std::size_t add_vectors(const std::vector<Eigen::Vector2f>& values, int target = 34962);

 private:
  friend std::string pack_glb(internal::Json document, GlbBuffer& buffer);
  std::string bytes_;
  internal::Json views_ = internal::Json::array(), accessors_ = internal::Json::array();
};

/// A document with one mesh of one primitive, unlit, with its texture: image, texture and material 0. Lacks what
/// `pack_glb` adds. Errors: invalid_argument (options), degenerate (no triangles).
internal::Json textured_document(const TexturedMesh& textured, const FileVertices& file, const GlbOptions& options,
                                 GlbBuffer& buffer);

/// Adds the buffer's accessors and views to the document and joins both. Errors: unsupported (more than 4 GB).
std::string pack_glb(internal::Json document, GlbBuffer& buffer);

}  // namespace lumihull::slf
