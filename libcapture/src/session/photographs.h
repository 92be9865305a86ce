#pragma once

// Names of photographs, and the way of a file from the camera to its place.

#include <lumihull/capture/journal.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace lumihull::capture::internal {

/// The photographs' names, without extension, as JournalState::shots; empty where nothing is photographed.
/// Error{bad_input}: an unknown field in braces, no plain file name, names used twice, a name that looks like a
/// retake's.
std::vector<std::string> photograph_names(const JournalHead& head);

/// Where a shot's file arrives: a folder of its own, so that what is in it tells that the exposure was made.
std::filesystem::path incoming_folder(const std::filesystem::path& folder, ShotId shot);

/// The one picture in a shot's incoming folder that is whole; nullopt where there is none, or several.
std::optional<std::filesystem::path> arrived_picture(const std::filesystem::path& folder, ShotId shot);

/// After a `file` event: puts the file in its place where a killed session had not. False: it is nowhere.
/// Error{bad_input}: another file stands there.
bool put_in_place(const std::filesystem::path& folder, const Take& take);

/// For users: "a012-e03, camera main".
std::string shot_title(const JournalState& state, std::size_t shot);

}  // namespace lumihull::capture::internal
