#include <lumihull/base/files.h>

#include <system_error>

#include "stage.h"

namespace lumihull::slf {

namespace {

/// The value's bytes: exact, whatever a printed number would round.
template <class T>
void append_bytes(std::string& to, const T& value) {
  to.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void InputDigest::add(std::string_view field, std::string_view value) {
  // Lengths first, so that no two lists of fields share a text.
  text_ += std::to_string(field.size()) + ":" + std::string(field) + std::to_string(value.size()) + ":";
  text_ += value;
}

void InputDigest::add_file(std::string_view field, const std::filesystem::path& file) {
  add(field, file_exists(file) ? sha256_of_file(file) : "missing");
}

std::string InputDigest::hex() const { return sha256(text_); }

void add_photos(const Capture& capture, InputDigest& digest) {
  for (const Shot& shot : capture.shots) digest.add(shot.name, shot.stamp.sha256);
  for (const Shot& shot : capture.enclosure) digest.add("enclosure " + shot.name, shot.stamp.sha256);
}

namespace {

std::string intrinsics_bytes(const Capture& capture) {
  std::string bytes;
  for (const Camera& c : capture.cameras) {
    append_bytes(bytes, c.width);
    append_bytes(bytes, c.height);
    for (const double x : {c.f, c.s, c.skew, c.u0, c.v0, c.k1, c.k2, c.k3, c.p1, c.p2}) append_bytes(bytes, x);
  }
  return bytes;
}

}  // namespace

void add_intrinsics(const Capture& capture, InputDigest& digest) {
  digest.add("intrinsics", intrinsics_bytes(capture));
}

void add_cameras(const Capture& capture, InputDigest& digest) {
  std::string bytes = intrinsics_bytes(capture);
  for (const Shot& shot : capture.shots) {
    append_bytes(bytes, shot.camera);
    bytes += shot.cam_from_world ? 'p' : '-';
    if (!shot.cam_from_world) continue;
    for (int i = 0; i < 4; ++i) append_bytes(bytes, shot.cam_from_world->rotation.coeffs()[i]);
    for (int i = 0; i < 3; ++i) append_bytes(bytes, shot.cam_from_world->translation[i]);
  }
  digest.add("cameras", bytes);
  digest.add("hold-out", std::to_string(capture.hold_out()));
}

void add_masks(const Capture& capture, InputDigest& digest) {
  for (const Shot& shot : capture.shots) digest.add_file("mask " + shot.name, capture.mask_path(shot));
}

void add_surface_inputs(const Capture& capture, InputDigest& digest) {
  add_photos(capture, digest);
  add_cameras(capture, digest);
  add_masks(capture, digest);
  digest.add_file("hull", capture.hull_path());
}

bool always_needed(const Capture&, std::string&) { return true; }

bool file_exists(const std::filesystem::path& file) {
  std::error_code error;
  return std::filesystem::exists(file, error);
}

std::filesystem::path textured_path(const Capture& capture) { return capture.folder() / "textured.glb"; }

}  // namespace lumihull::slf
