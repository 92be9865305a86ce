#pragma once

#include <lumihull/base/api.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace lumihull::capture {

/// Whether a picture file is there to its end, by its structure alone (no pixel is decoded): JPEG to its end-of-image
/// marker (ITU-T T.81, annex B), PNG to its IEND chunk. Other formats have no end mark: any bytes will do.
/// Returns an empty text, or what is wrong: "a JPEG that stops in the middle".
LUMIHULL_API std::string picture_fault(std::string_view bytes);

/// By its name's end: jpg, png, tif, heic or camera RAW. `raw`: the last alone.
LUMIHULL_API bool is_picture_name(const std::filesystem::path& file);
LUMIHULL_API bool is_raw_name(const std::filesystem::path& file);

/// The extension in small letters, without the dot.
LUMIHULL_API std::string small_extension(const std::filesystem::path& file);

/// "FOLDER/STEM.EXTENSION", or with -2, -3, … behind the stem: the first name that is not in use. Nothing is made.
LUMIHULL_API std::filesystem::path free_name(const std::filesystem::path& folder, const std::string& stem,
                                             const std::string& extension);

}  // namespace lumihull::capture
