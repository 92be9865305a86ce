#pragma once

#include <lumihull/base/api.h>
#include <lumihull/capture/robot.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace lumihull::capture {

/// A camera on a cable or in the network, driven through libgphoto2 by a helper program, `lumihull-gphoto2`.
struct GphotoOptions {
  std::string port = "usb:";  ///< as gphoto2 writes it: "usb:001,004", "ptpip:192.168.1.1"
  std::string model;          ///< as `gphoto2 --list-cameras` writes it; empty: found out, which works for USB alone
  double open_timeout_s = 30;
  double event_timeout_s = 15;         ///< from the end of the exposure until its picture is announced
  double download_timeout_s = 60;      ///< for all files of one exposure
  bool delete_after_download = false;  ///< from the camera, once the file is safe on disk
  std::filesystem::path helper;        ///< empty: the one that was installed with this library
};

/// Connects. Exposure, aperture and focus are set on the camera; `exposure_s` of `shoot` only lengthens the waiting.
///
/// The camera is asked by a child process, whose every answer has a deadline: one that hangs (libgphoto2 may, when an
/// event is lost) is killed, and the next `shoot` starts another. Files are called "shot-000012.jpg" after the shot's
/// number. RAW + JPEG come as two files of one stem; `ShotOutcome::file` is the JPEG.
///
/// shoot's outcome: `refused` where the camera declined or could not be reached; `done` without a file where the
/// picture was taken and stays on the card (download failed; more pictures came than one exposure makes, so that none
/// can be told to be its); `unknown` where the camera fell silent after the release. A number that was `done` or
/// `unknown` is never exposed again: its outcome is given once more. After the release `Job::cancel` waits for the
/// outcome. A camera that is lost is `refused` until it is back.
///
/// Errors: not_found (no helper program), invalid_argument, io (no such camera, it can't be opened), cancelled.
LUMIHULL_API std::unique_ptr<CameraDevice> open_gphoto_camera(const GphotoOptions& options, Job& job);

struct FoundCamera {
  std::string model, port;
};
/// Cameras on USB. Errors: not_found (no helper program), io, cancelled.
LUMIHULL_API std::vector<FoundCamera> find_gphoto_cameras(Job& job, const std::filesystem::path& helper = {});

/// A camera that is fired by something else, and whose files appear in a folder: another program's tethering, a phone
/// that synchronises, a person.
struct FolderCameraOptions {
  std::filesystem::path watched;  ///< subfolders are not looked into
  /// Asks for the exposure: fires the other program, or tells a person. Returns false where it was surely not made.
  /// Empty: nobody is asked.
  std::function<bool(ShotId id, double exposure_s)> release;
  double timeout_s = 60;  ///< from the release until the file is there, beyond the exposure
  double quiet_s = 1;     ///< a file whose writer does not tell that it is done must not have grown for so long
  /// After the first file: how long a second one of the same stem (RAW + JPEG) is waited for.
  double pair_s = 2;
};

/// Waits for exactly one new picture a shot; RAW + JPEG of one stem are one.
///
/// A file is new when it was not there, or was another (inode, size, time), when `shoot` began; what is there before is
/// never taken. It is complete when its writer has closed it or it has not grown for `quiet_s`, and its content ends as
/// JPEG or PNG must. Hidden files and those of unfinished transfers (.part, .tmp, .crdownload, …) are not looked at.
/// A second file with the first one's content is the same picture; with another, two pictures came: then the outcome is
/// `done` without a file, and both stay where they are. Files are moved into the shot's folder under the shot's number.
///
/// shoot's outcome: `unknown` where no picture came in time; the next shot's `detail` then says that its picture may be
/// the late one, for a folder does not tell. As above, no number is exposed twice.
/// Errors: not_found, invalid_argument (`watched` is no folder, times that are not positive), io.
LUMIHULL_API std::unique_ptr<CameraDevice> watch_folder(const FolderCameraOptions& options);

}  // namespace lumihull::capture
