#include <lumihull/base/files.h>
#include <lumihull/slf/glb.h>

#include "glb_write.h"

namespace lumihull::slf {

std::string encode_glb(const TexturedMesh& textured, const GlbOptions& options) {
  validate(textured, "textured mesh");
  GlbBuffer buffer;
  internal::Json document = textured_document(textured, split_vertices(textured), options, buffer);
  return pack_glb(std::move(document), buffer);
}

std::uint64_t write_glb(const std::filesystem::path& file, const TexturedMesh& textured, const GlbOptions& options) {
  const std::string bytes = encode_glb(textured, options);
  write_file(file, bytes);
  return bytes.size();
}

}  // namespace lumihull::slf
