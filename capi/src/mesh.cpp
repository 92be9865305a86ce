#include <lumihull/hull/mesh.h>
#include <lumihull/hull/mesh_check.h>
#include <lumihull/hull/simplify.h>

#include "arguments.h"
#include "context.h"
#include "handles.h"

using namespace lumihull;
using namespace lumihull::capi;

static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float) && sizeof(hull::Mesh::triangles[0]) == 3 * sizeof(uint32_t),
              "vertices and triangles are plain arrays");

lh_status lh_mesh_from_arrays(lh_context* ctx, const float* vertices, size_t n, const uint32_t* triangles, size_t m,
                              lh_mesh** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    const auto v = array(vertices, n, 3, "vertices");
    const auto t = array(triangles, m, 3, "triangles");
    hull::Mesh mesh;
    mesh.vertices.resize(n);
    mesh.triangles.resize(m);
    if (n) std::memcpy(static_cast<void*>(mesh.vertices.data()), v.data(), v.size_bytes());
    if (m) std::memcpy(mesh.triangles.data(), t.data(), t.size_bytes());
    hull::validate(mesh, "mesh");
    give(out, std::move(mesh));
  });
}

lh_status lh_mesh_read(lh_context* ctx, const char* file, lh_mesh** out) {
  return guarded(ctx, [&] {
    given(out, "out");
    give(out, hull::read_mesh(path(file, "file")));
  });
}

lh_status lh_mesh_write(lh_context* ctx, const lh_mesh* mesh, const char* file) {
  return guarded(ctx, [&] { hull::write_mesh(path(file, "file"), given(mesh, "mesh").value); });
}

void lh_mesh_destroy(lh_mesh* mesh) { delete mesh; }

size_t lh_mesh_vertex_count(const lh_mesh* mesh) { return mesh ? mesh->value.vertices.size() : 0; }
size_t lh_mesh_triangle_count(const lh_mesh* mesh) { return mesh ? mesh->value.triangles.size() : 0; }

lh_status lh_mesh_vertices(lh_context* ctx, const lh_mesh* mesh, float* out, size_t n) {
  return guarded(ctx, [&] {
    const auto& from = given(mesh, "mesh").value.vertices;
    const auto to = room(out, n, from.size(), 3, "out");
    if (!from.empty()) std::memcpy(to.data(), from.data(), to.size_bytes());
  });
}

lh_status lh_mesh_triangles(lh_context* ctx, const lh_mesh* mesh, uint32_t* out, size_t n) {
  return guarded(ctx, [&] {
    const auto& from = given(mesh, "mesh").value.triangles;
    const auto to = room(out, n, from.size(), 3, "out");
    if (!from.empty()) std::memcpy(to.data(), from.data(), to.size_bytes());
  });
}

lh_status lh_mesh_normals(lh_context* ctx, const lh_mesh* mesh, float* out, size_t n) {
  return guarded(ctx, [&] {
    const hull::Mesh& m = given(mesh, "mesh").value;
    const auto to = room(out, n, m.vertices.size(), 3, "out");
    const auto normals = hull::vertex_normals(m);
    if (!normals.empty()) std::memcpy(to.data(), normals.data(), to.size_bytes());
  });
}

lh_status lh_mesh_volume(lh_context* ctx, const lh_mesh* mesh, double* out) {
  return guarded(ctx, [&] { given(out, "out") = hull::enclosed_volume(given(mesh, "mesh").value); });
}

lh_status lh_mesh_check(lh_context* ctx, const lh_mesh* mesh, int32_t self_intersections, lh_mesh_report* out) {
  return guarded(ctx, [&] {
    checked_struct_size(given(out, "out").struct_size, "out");
    const hull::MeshCheck check = hull::check_mesh(given(mesh, "mesh").value, self_intersections != 0);
    lh_mesh_report report{};
    report.closed = check.closed;
    report.manifold = check.manifold;
    report.oriented = check.oriented;
    report.self_intersections_known = check.self_intersections.has_value();
    report.self_intersections = check.self_intersections.value_or(0);
    report.degenerate_triangles = check.degenerate_triangles;
    report.unused_vertices = check.unused_vertices;
    report.parts = check.parts;
    report.euler = check.euler;
    write_struct(out, report, "out");
  });
}

lh_status lh_mesh_simplify(lh_context* ctx, const lh_mesh* mesh, size_t max_triangles, double max_error, lh_mesh** out,
                           double* moved) {
  return guarded(ctx, [&](Job& job) {
    given(out, "out");
    hull::SimplifyResult result = hull::simplify(given(mesh, "mesh").value, {max_triangles, max_error}, job);
    give(out, std::move(result.mesh));
    if (moved) *moved = result.moved.max;
  });
}
