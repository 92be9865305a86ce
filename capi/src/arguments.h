#pragma once

// Checks of what callers pass, and the C structures' way in and out. Everything throws Error{invalid_argument} whose
// subject is the argument's name in lumihull.h.

#include <lumihull.h>
#include <lumihull/base/camera.h>
#include <lumihull/base/error.h>
#include <lumihull/base/pose.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace lumihull::capi {

[[noreturn]] inline void invalid(const std::string& message, const char* argument) {
  throw Error(ErrorCode::invalid_argument, message, argument);
}

template <class T>
T& given(T* pointer, const char* name) {
  if (!pointer) invalid("expected a value, found NULL", name);
  return *pointer;
}

/// A string that is not NULL.
inline const char* text(const char* pointer, const char* name) { return &given(pointer, name); }

/// The rule of the option structs: zero is the default.
template <class T>
T or_default(T value, T fallback) {
  return value == T(0) ? fallback : value;
}

/// A file's or folder's name: not NULL, not empty.
inline std::string path(const char* pointer, const char* name) {
  if (*text(pointer, name) == '\0') invalid("expected a path, found an empty string", name);
  return pointer;
}

/// rows x columns values; NULL only where rows is 0.
template <class T>
std::span<T> array(T* pointer, std::size_t rows, std::size_t columns, const char* name) {
  if (rows > std::size_t(PTRDIFF_MAX) / sizeof(T) / columns)
    invalid("expected an array that fits into memory, found " + std::to_string(rows) + " rows", name);
  if (rows > 0) given(pointer, name);
  return {pointer, rows * columns};
}

/// Room for `count` rows in a caller's array of `rows`.
template <class T>
std::span<T> room(T* pointer, std::size_t rows, std::size_t count, std::size_t columns, const char* name) {
  if (rows < count)
    invalid("expected room for " + std::to_string(count) + " rows, found " + std::to_string(rows), name);
  return array(pointer, count, columns, name);
}

inline std::size_t index(std::size_t i, std::size_t count, const char* name) {
  if (i >= count) invalid("expected less than " + std::to_string(count) + ", found " + std::to_string(i), name);
  return i;
}

/// The largest structure that a later version may come with: a size beyond is no size.
inline constexpr std::size_t kMaxStructSize = 4096;

inline std::size_t checked_struct_size(std::size_t size, const char* name) {
  if (size < sizeof(std::size_t) || size > kMaxStructSize)
    invalid("expected struct_size to be the structure's size, found " + std::to_string(size), name);
  return size;
}

/// A caller's structure as today's: what an older caller does not know is zero; what a later one added must be zero.
template <class T>
T read_struct(const T* user, const char* name) {
  static_assert(offsetof(T, struct_size) == 0 && std::is_trivially_copyable_v<T>);
  T value{};
  value.struct_size = sizeof(T);
  if (!user) return value;
  const std::size_t size = checked_struct_size(user->struct_size, name);
  const auto* bytes = reinterpret_cast<const unsigned char*>(user);
  if (size > sizeof(T) && std::any_of(bytes + sizeof(T), bytes + size, [](unsigned char b) { return b != 0; }))
    invalid("the structure is from a later version of lumihull.h and sets a field that this library does not know",
            name);
  std::memcpy(&value, bytes, std::min(size, sizeof(T)));
  value.struct_size = sizeof(T);
  return value;
}

/// Fills as much of a caller's structure as it has; what it has more is zeroed.
template <class T>
void write_struct(T* user, const T& value, const char* name) {
  const std::size_t size = checked_struct_size(given(user, name).struct_size, name);
  auto* bytes = reinterpret_cast<unsigned char*>(user);
  std::memcpy(bytes + sizeof(std::size_t), reinterpret_cast<const unsigned char*>(&value) + sizeof(std::size_t),
              std::min(size, sizeof(T)) - sizeof(std::size_t));
  if (size > sizeof(T)) std::memset(bytes + sizeof(T), 0, size - sizeof(T));
}

/// The count query and the fill of a text result.
void give_text(std::string_view text, char* buffer, std::size_t size, std::size_t* needed);

/// Checks that it is a valid camera.
Camera camera_from(const lh_camera* camera, const char* name);
lh_camera camera_to(const Camera& camera);

/// From a 3 x 4 matrix; checks that it is a rigid transform.
Pose pose_from(const double* matrix, const char* name);
void pose_to(const Pose& pose, double* matrix);

/// Hands a new object to the caller: nothing after it may fail.
template <class Handle, class... Value>
void give(Handle** out, Value&&... value) {
  *out = new Handle{std::forward<Value>(value)...};
}

}  // namespace lumihull::capi
