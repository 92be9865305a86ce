#pragma once

// Checked reading of glTF binaries.

#include <lumihull/base/image.h>
#include <lumihull/internal/json.h>
#include <lumihull/slf/textured_mesh.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lumihull::slf {

/// A file in memory and what is asked of it. Every answer is checked; errors: bad_input naming the file and what was
/// expected, unsupported (valid, but not read here).
class GlbFile {
 public:
  /// Errors: not_found, io, bad_input, unsupported.
  explicit GlbFile(const std::filesystem::path& path);
  /// The same of bytes in memory; `name` is used in errors.
  GlbFile(std::string bytes, std::string name);
  GlbFile(const GlbFile&) = delete;
  GlbFile& operator=(const GlbFile&) = delete;

  const std::string& name() const { return name_; }
  internal::JsonReader top() const { return {document_, name_}; }
  /// The first primitive of the first mesh.
  internal::JsonReader primitive() const;

  /// The bytes of a buffer view, within the binary chunk.
  std::string_view view(std::size_t index) const;
  std::vector<Eigen::Vector3f> vectors3(std::size_t accessor) const;
  std::vector<Eigen::Vector2f> vectors2(std::size_t accessor) const;
  std::vector<std::uint32_t> integers(std::size_t accessor) const;
  /// The picture of a texture, 8-bit RGB.
  Image texture(std::size_t index) const;
  /// The same where it is to be as large as another one: its size is known before it is unpacked.
  Image texture_like(const Image& other, std::size_t index) const;

  /// The primitive as a mesh with texture: its vertices are the file's.
  TexturedMesh textured_mesh() const;

 private:
  /// The bytes of a texture's picture.
  std::span<const std::byte> picture(std::size_t texture) const;
  std::string texture_name(std::size_t index) const;

  std::string bytes_, name_;
  std::string_view binary_;
  internal::Json document_;
};

/// The number that an index, count or size is, within a file of at most 4 GB.
std::size_t glb_index(const internal::JsonReader& value);

}  // namespace lumihull::slf
