#include "session_truth.h"

#include <lumihull/base/error.h>
#include <lumihull/capture/session.h>

#include "truth.h"

namespace lumihull::rig {

namespace fs = std::filesystem;

std::vector<NamedExposure> exposures_of(const fs::path& folder) {
  const capture::JournalState state = capture::read_journal(capture::journal_path(folder));
  std::vector<NamedExposure> found;
  for (const capture::ShotProgress& shot : state.shots) {
    if (shot.landed.empty()) continue;
    const capture::Take& take = shot.landed.back();
    auto exposure = read_exposure(folder / "truth", take.shot);
    if (!exposure || exposure->sha256 != take.sha256)
      throw Error(ErrorCode::bad_input, "the truth of exposure " + std::to_string(take.shot) + " is not there",
                  (folder / "photos" / take.file).string());
    std::string name = fs::path(take.file).stem().string();
    if (const std::size_t retake = name.rfind('~'); retake != std::string::npos) name.resize(retake);
    found.push_back({name, std::move(*exposure)});
  }
  return found;
}

void write_session_truth(const fs::path& folder, const RigSession& session, const std::vector<NamedExposure>& exposures,
                         Job& job) {
  const fs::path truth = folder / "truth";
  NamedShots shots;
  for (const NamedExposure& e : exposures) {
    shots.names.push_back(e.name);
    shots.cam_from_world.push_back(e.exposure.cam_from_world);
    char number[32];
    std::snprintf(number, sizeof number, "%06u", unsigned(e.exposure.id));
    for (const auto& [extension, sub] : {std::pair(".png", "masks"), std::pair(".depth", "depth")}) {
      const fs::path from = truth / "exposures" / (number + std::string(extension));
      if (!fs::exists(from)) continue;
      fs::create_directories(truth / sub);
      fs::rename(from, truth / sub / (e.name + extension));
    }
  }
  write_camera_truth(truth / "cameras.json", session.scene, session.lens.camera, shots);
  if (!session.targets.placed.empty()) write_target_truth(truth / "targets.json", session.targets.placed);
  hull::write_mesh(truth / "mesh.ply", session.scene.objects[0].mesh);
  const HighlightFinder finder(session.scene);
  if (finder.any())
    write_highlights(truth / "highlights.json", finder, session.lens.camera, shots, session.lens.photo.exposure, job);
}

}  // namespace lumihull::rig
