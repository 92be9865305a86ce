#include <lumihull/base/error.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/simplify.h>

#include <algorithm>
#include <array>
#include <cmath>

// OpenMesh asserts at every access that a property's type has the expected name, as text: half of the time and more.
#ifndef NDEBUG
#define NDEBUG
#define LUMIHULL_OPENMESH_ASSERTS
#endif
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#ifdef LUMIHULL_OPENMESH_ASSERTS
#undef NDEBUG
#include <cassert>
#endif

namespace lumihull::hull {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
  FaceAttributes(OpenMesh::Attributes::Status | OpenMesh::Attributes::Normal);
};
using HalfedgeMesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;

/// Throws Error{bad_input} where the triangles are no closed manifold: such a surface has no halfedges, or a border
/// that collapses would eat away.
HalfedgeMesh halfedges_of(const Mesh& mesh) {
  if (const MeshCheck check = check_mesh(mesh, false); !check.manifold || !check.oriented)
    throw Error(ErrorCode::bad_input, "only a closed, consistently oriented manifold can be simplified", "mesh");
  HalfedgeMesh out;
  out.reserve(mesh.vertices.size(), mesh.triangles.size() * 3 / 2, mesh.triangles.size());
  for (const auto& v : mesh.vertices) out.add_vertex({v.x(), v.y(), v.z()});
  const auto vertex = [](std::uint32_t v) { return OpenMesh::VertexHandle(int(v)); };
  for (const auto& t : mesh.triangles) out.add_face(vertex(t[0]), vertex(t[1]), vertex(t[2]));
  out.update_face_normals();
  return out;
}

Mesh mesh_of(const HalfedgeMesh& from) {
  Mesh out;
  std::vector<std::uint32_t> renumbered(from.n_vertices(), ~std::uint32_t(0));
  for (const auto v : from.vertices()) {  // those that were not deleted, in order
    if (from.is_isolated(v)) continue;
    renumbered[std::size_t(v.idx())] = std::uint32_t(out.vertices.size());
    const auto& p = from.point(v);
    out.vertices.push_back({p[0], p[1], p[2]});
  }
  for (const auto f : from.faces()) {
    std::array<std::uint32_t, 3> t{};
    int k = 0;
    for (const auto v : from.fv_range(f)) t[std::size_t(k++)] = renumbered[std::size_t(v.idx())];
    out.triangles.push_back(t);
  }
  return out;
}

}  // namespace

SimplifyResult simplify(const Mesh& mesh, const SimplifyOptions& options, Job& job) {
  if (!std::isfinite(options.max_error) || options.max_error < 0 ||
      (options.max_triangles == 0 && options.max_error == 0))
    throw Error(ErrorCode::invalid_argument, "simplification needs a number of triangles or a positive error");
  validate(mesh, "mesh");
  SimplifyResult result;
  if (mesh.empty()) return result;

  HalfedgeMesh surface = halfedges_of(mesh);
  OpenMesh::Decimater::DecimaterT<HalfedgeMesh> decimater(surface);
  OpenMesh::Decimater::ModQuadricT<HalfedgeMesh>::Handle quadric;
  decimater.add(quadric);
  OpenMesh::Decimater::ModNormalFlippingT<HalfedgeMesh>::Handle flipping;
  decimater.add(flipping);
  decimater.module(quadric).unset_max_err();  // it orders the collapses; distances are kept by a module of their own
  OpenMesh::Decimater::ModHausdorffT<HalfedgeMesh>::Handle bound;
  if (options.max_error > 0) {
    decimater.add(bound);
    decimater.module(bound).set_tolerance(options.max_error);
  }
  struct Stop : OpenMesh::Decimater::Observer {
    explicit Stop(const Job& j) : Observer(4096), job(j) {}
    void notify(std::size_t) override {}
    bool abort() const override { return job.cancelled(); }
    const Job& job;
  } stop(job);
  decimater.set_observer(&stop);
  decimater.initialize();
  if (options.max_triangles > 0 && mesh.triangles.size() > options.max_triangles)
    decimater.decimate_to_faces(0, options.max_triangles);
  else if (options.max_triangles == 0)
    decimater.decimate();
  job.check();
  surface.garbage_collection();

  result.mesh = mesh_of(surface);
  result.reached = options.max_triangles == 0 || result.mesh.triangles.size() <= options.max_triangles;
  if (result.mesh.triangles.size() < mesh.triangles.size()) {
    const MeshDistance there = distance(mesh, result.mesh, job), back = distance(result.mesh, mesh, job);
    result.moved = {std::max(there.max, back.max), std::max(there.rms, back.rms)};
  }
  return result;
}

}  // namespace lumihull::hull
