#pragma once

// A mesh as Embree holds it, for all that asks it: rays and nearest points.

#include <embree3/rtcore.h>
#include <lumihull/base/error.h>
#include <lumihull/hull/mesh.h>

#include <cstring>
#include <string>

namespace lumihull::hull {

class EmbreeScene {
 public:
  /// Copies the mesh; triangle i of it is primitive i of geometry 0. Errors: bad_input (bad indices), out_of_memory.
  explicit EmbreeScene(const Mesh& mesh) {
    validate(mesh, "mesh");
    device_ = rtcNewDevice(nullptr);
    if (!device_) throw Error(ErrorCode::internal, "Embree does not start on this machine");
    try {
      build(mesh);
    } catch (...) {
      release();
      throw;
    }
  }
  EmbreeScene(const EmbreeScene&) = delete;
  EmbreeScene& operator=(const EmbreeScene&) = delete;
  ~EmbreeScene() { release(); }

  RTCScene get() const { return scene_; }

  /// Whether packets of 16 rays are traced as such here (AVX-512).
  bool takes_16_rays() const { return rtcGetDeviceProperty(device_, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0; }

 private:
  void build(const Mesh& mesh) {
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    if (!mesh.triangles.empty()) {
      RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
      void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                               sizeof(Eigen::Vector3f), mesh.vertices.size());
      void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                              3 * sizeof(std::uint32_t), mesh.triangles.size());
      if (vertices && indices) {
        std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * sizeof(Eigen::Vector3f));
        std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(std::uint32_t));
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene_, geometry, 0);
      }
      rtcReleaseGeometry(geometry);
      check("to store the mesh");
    }
    rtcCommitScene(scene_);
    check("to build its tree");
  }

  void check(const char* doing) const {
    const RTCError error = rtcGetDeviceError(device_);
    if (error == RTC_ERROR_NONE) return;
    throw Error(error == RTC_ERROR_OUT_OF_MEMORY ? ErrorCode::out_of_memory : ErrorCode::internal,
                std::string("Embree failed ") + doing + " (error " + std::to_string(int(error)) + ")");
  }

  void release() {
    if (scene_) rtcReleaseScene(scene_);
    if (device_) rtcReleaseDevice(device_);
  }

  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
};

}  // namespace lumihull::hull
