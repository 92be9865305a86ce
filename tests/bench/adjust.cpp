// placeholder
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <sys/resource.h>
#include "../calib/adjust/scenes.h"
using namespace lumihull;
int main(int argc, char** argv) {
  test::SceneMaker m; m.shots = atoi(argv[1]); m.bodies = atoi(argv[2]); m.model = argv[3][0]=='f' ? calib::BodyModel::free : calib::BodyModel::rigid;
  m.radius = argc > 4 ? atof(argv[4]) : 0;
  auto scene = test::make_scene(m, 1);
  struct rusage u; getrusage(RUSAGE_SELF,&u); double c0=u.ru_utime.tv_sec+1e-6*u.ru_utime.tv_usec+u.ru_stime.tv_sec+1e-6*u.ru_stime.tv_usec;
  for (bool cov : {false, true}) {
  auto t0 = std::chrono::steady_clock::now();
  Job job({}, 2);
  auto r = calib::adjust(scene.start, {.covariances = cov}, job);
  double t = std::chrono::duration<double>(std::chrono::steady_clock::now()-t0).count();
  getrusage(RUSAGE_SELF,&u); double c1=u.ru_utime.tv_sec+1e-6*u.ru_utime.tv_usec+u.ru_stime.tv_sec+1e-6*u.ru_stime.tv_usec;
  printf("%zu obs, cov %d: %.2f s wall, %.2f s cpu, %d iterations, cost %.12g -> %.12g, rms %.5f sigma0 %.4f points %.3g um, peak %ld MB\n", scene.start.observations.size(), cov, t, c1-c0, r.iterations, r.start_cost, r.cost, r.rms_px, r.sigma0, 1e6*test::point_rms(r.adjusted, scene.truth, true), u.ru_maxrss/1024);
  c0=c1;
  }
}
