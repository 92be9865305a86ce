// Bundle adjustment beside COLMAP's bundle_adjuster and plain Ceres, on one problem and from one start, all answers
// judged by one function.
//
//     bench_adjust [--shots 120] [--bodies 8] [--seed 1] [--threads 2] [--no-colmap] [--no-ceres]
//
// A camera without distortion (in everybody's models; f, u0, v0 free), targets of 5 x 5 points as free points, all
// visible, 0.05 px noise, equal weights. Then ours alone: with the lens, rigid targets, circles, covariances.
#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <optional>

#include "../calib/adjust/ceres_bundle.h"
#include "../calib/adjust/scenes.h"

namespace {

using namespace lumihull;
namespace fs = std::filesystem;

struct Clock {
  double wall = 0, cpu = 0;
};

Clock now(int who) {
  rusage u{};
  getrusage(who, &u);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return {std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          seconds(u.ru_utime) + seconds(u.ru_stime)};
}

long peak_megabytes() {
  rusage u{};
  getrusage(RUSAGE_SELF, &u);
  return u.ru_maxrss / 1024;
}

/// Σ |measured - predicted|², px².
double objective(const calib::Adjustment& a) {
  double sum = 0;
  for (const calib::Observation& o : a.observations) sum += (o.pixel - test::predicted_pixel(a, o)).squaredNorm();
  return sum;
}

void report(const char* what, const Clock& from, const Clock& to, int iterations, const calib::Adjustment& answer,
            const calib::Adjustment& truth) {
  const double cost = objective(answer);
  std::printf("%-28s %8.2f s wall %8.2f s CPU %4d iterations  objective %.12g px²  RMS %.6f px  points %.3f µm\n", what,
              to.wall - from.wall, to.cpu - from.cpu, iterations, cost,
              std::sqrt(cost / double(answer.observations.size())), 1e6 * test::point_rms(answer, truth, true));
  std::fflush(stdout);
}

void write_colmap(const calib::Adjustment& a, const fs::path& folder) {
  fs::create_directories(folder);
  const Camera& c = a.cameras[0].camera;
  std::ofstream(folder / "cameras.txt") << std::setprecision(17) << "1 SIMPLE_PINHOLE " << c.width << ' ' << c.height
                                        << ' ' << c.f << ' ' << c.u0 << ' ' << c.v0 << '\n';
  std::vector<std::size_t> first;
  std::size_t points = 0;
  for (const calib::AdjustedBody& body : a.bodies) first.push_back(points), points += body.points.size();
  std::vector<std::string> rows(a.shots.size()), tracks(points);
  std::vector<int> counts(a.shots.size(), 0);
  for (const calib::Observation& o : a.observations) {
    const std::size_t point = first[o.body] + o.point;
    char text[96];
    std::snprintf(text, sizeof text, "%.17g %.17g %zu ", o.pixel.x(), o.pixel.y(), point + 1);
    rows[o.shot] += text;
    tracks[point] += " " + std::to_string(o.shot + 1) + " " + std::to_string(counts[o.shot]++);
  }
  std::ofstream images(folder / "images.txt");
  images << std::setprecision(17);
  for (std::size_t s = 0; s < a.shots.size(); ++s) {
    const Eigen::Quaterniond& q = a.shots[s].rig_from_world.rotation;
    const Eigen::Vector3d& t = a.shots[s].rig_from_world.translation;
    images << s + 1 << ' ' << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << t.x() << ' ' << t.y()
           << ' ' << t.z() << " 1 " << s << ".jpg\n"
           << rows[s] << '\n';
  }
  std::ofstream file(folder / "points3D.txt");
  file << std::setprecision(17);
  for (std::size_t b = 0; b < a.bodies.size(); ++b)
    for (std::size_t i = 0; i < a.bodies[b].points.size(); ++i) {
      const Eigen::Vector3d x = a.bodies[b].point(i);
      file << first[b] + i + 1 << ' ' << x.x() << ' ' << x.y() << ' ' << x.z() << " 0 0 0 0" << tracks[first[b] + i]
           << '\n';
    }
}

/// Poses, points and the camera of a binary model.
void read_colmap(calib::Adjustment& a, const fs::path& folder) {
  const auto get = [](std::ifstream& in, auto value) {
    in.read(reinterpret_cast<char*>(&value), sizeof value);
    if (!in) throw std::runtime_error("COLMAP's answer ends too early");
    return value;
  };
  std::ifstream cameras(folder / "cameras.bin", std::ios::binary);
  cameras.ignore(8 + 4 + 4 + 8 + 8);
  Camera& c = a.cameras[0].camera;
  c.f = get(cameras, 0.0), c.u0 = get(cameras, 0.0), c.v0 = get(cameras, 0.0);
  std::ifstream images(folder / "images.bin", std::ios::binary);
  for (std::uint64_t n = get(images, std::uint64_t(0)); n > 0; --n) {
    Pose& pose = a.shots.at(get(images, std::uint32_t(0)) - 1).rig_from_world;
    const double w = get(images, 0.0), x = get(images, 0.0), y = get(images, 0.0), z = get(images, 0.0);
    pose.rotation = Eigen::Quaterniond(w, x, y, z).normalized();
    for (int i = 0; i < 3; ++i) pose.translation[i] = get(images, 0.0);
    images.ignore(4);
    while (get(images, char(0)) != 0) {
    }
    images.ignore(std::streamsize(24 * get(images, std::uint64_t(0))));
  }
  std::ifstream points(folder / "points3D.bin", std::ios::binary);
  for (std::uint64_t n = get(points, std::uint64_t(0)); n > 0; --n) {
    std::uint64_t id = get(points, std::uint64_t(0)) - 1;
    Eigen::Vector3d x;
    for (int i = 0; i < 3; ++i) x[i] = get(points, 0.0);
    for (calib::AdjustedBody& body : a.bodies) {
      if (id < body.points.size()) {
        body.free_places[id] = x;
        break;
      }
      id -= body.points.size();
    }
    points.ignore(3 + 8);
    points.ignore(std::streamsize(8 * get(points, std::uint64_t(0))));
  }
}

void colmap(const test::Scene& scene) {
  const fs::path folder = fs::temp_directory_path() / ("lumihull-bench-adjust-" + std::to_string(getpid()));
  write_colmap(scene.start, folder / "in");
  fs::create_directories(folder / "out");
  const std::string command = "colmap bundle_adjuster --input_path " + (folder / "in").string() + " --output_path " +
                              (folder / "out").string() + " --BundleAdjustment.refine_principal_point 1 > " +
                              (folder / "log").string() + " 2>&1";
  const Clock from = now(RUSAGE_CHILDREN);
  const int failed = std::system(command.c_str());
  const Clock to = now(RUSAGE_CHILDREN);
  if (failed) {
    std::printf("%-28s not here, or it failed\n", "COLMAP");
  } else {
    int iterations = 0;
    std::ifstream log(folder / "log");
    for (std::string line; std::getline(log, line);)
      if (line.find("Iterations :") != std::string::npos)
        iterations = std::atoi(line.substr(line.find(':') + 1).c_str());
    calib::Adjustment answer = scene.start;
    read_colmap(answer, folder / "out");
    report("COLMAP (reading included)", from, to, iterations, answer, scene.truth);
  }
  fs::remove_all(folder);
}

calib::AdjustResult ours(const char* what, const test::Scene& scene, bool covariances, unsigned threads) {
  Job job({}, threads);
  const Clock from = now(RUSAGE_SELF);
  calib::AdjustResult result = calib::adjust(scene.start, {.covariances = covariances}, job);
  report(what, from, now(RUSAGE_SELF), result.iterations, result.adjusted, scene.truth);
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  test::SceneMaker maker{.shots = 120, .bodies = 8, .model = calib::BodyModel::free};
  std::uint64_t seed = 1;
  unsigned threads = 2;
  bool no_colmap = false, no_ceres = false;
  CLI::App app("Bundle adjustment beside COLMAP and Ceres");
  app.add_option("--shots", maker.shots);
  app.add_option("--bodies", maker.bodies);
  app.add_option("--seed", seed);
  app.add_option("--threads", threads);
  app.add_flag("--no-colmap", no_colmap);
  app.add_flag("--no-ceres", no_ceres);
  CLI11_PARSE(app, argc, argv);

  test::Scene scene = test::make_scene(maker, seed);
  for (calib::Adjustment* a : {&scene.truth, &scene.start}) {
    Camera& c = a->cameras[0].camera;
    c.k1 = c.k2 = c.p1 = c.p2 = 0;
    a->cameras[0].free = {true, false, false, true, true, false, false, false, false, false};
  }
  // The noise that the scene's lens saw, on pixels without lens.
  test::Scene lens = test::make_scene(maker, seed);
  for (std::size_t i = 0; i < scene.start.observations.size(); ++i) {
    calib::Observation& o = scene.start.observations[i];
    o.pixel += test::predicted_pixel(scene.truth, o) - test::predicted_pixel(lens.truth, o);
    o.covariance.setIdentity();
  }
  std::printf("%d photographs, %d targets of 25 points, %zu observations, %u threads\n", maker.shots, maker.bodies,
              scene.start.observations.size(), threads);
  ours("ours", scene, false, threads);
  if (!no_colmap) colmap(scene);
  if (!no_ceres)
    for (const test::CeresSchur schur : {test::CeresSchur::dense, test::CeresSchur::iterative}) {
      const Clock from = now(RUSAGE_SELF);
      const auto answer = test::adjust_by_ceres(
          scene.start, {}, {.schur = schur, .max_iterations = 30, .tolerance = 1e-10, .threads = int(threads)});
      report(schur == test::CeresSchur::dense ? "Ceres, DENSE_SCHUR" : "Ceres, ITERATIVE_SCHUR", from, now(RUSAGE_SELF),
             answer.iterations, answer.adjusted, scene.truth);
    }
  std::printf("\nours, with the lens and unequal weights\n");
  ours("free points", lens, false, threads);
  ours("free points, covariances", lens, true, threads);
  test::SceneMaker other = maker;
  other.model = calib::BodyModel::rigid;
  ours("rigid targets", test::make_scene(other, seed), false, threads);
  ours("rigid targets, covariances", test::make_scene(other, seed), true, threads);
  other.radius = 0.009;
  ours("rigid targets of circles", test::make_scene(other, seed), false, threads);
  std::printf("peak of this process %ld MB\n", peak_megabytes());
}
